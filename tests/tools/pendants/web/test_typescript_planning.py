"""The page's plans and scene: their tests in Node."""

import pytest
from rigs.processes.node_tests import run_node_test


@pytest.mark.parametrize("name", ["planning", "scene"])
def test_their_tests_in_node_pass(name: str) -> None:
    run_node_test(name)
