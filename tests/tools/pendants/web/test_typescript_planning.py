"""The page's plans: their tests in Node."""

from rigs.processes.node_tests import run_node_test


def test_its_tests_of_plans_pass() -> None:
    run_node_test("planning")
