"""What every test has: a clock to choose, and the same random examples in every run."""

import asyncio
import gc
import os
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
import workers
from hypothesis import HealthCheck, Phase, settings
from lanes import Lane, OneLane, add_option
from promises.promise_table import tests_of_promises
from rigs.clock.busy_machine import Attempts
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.warm_start import import_programs

from openpendant.server.store.store_client import STORE_VARIABLE

TESTS = Path(__file__).parent

# The same examples in every run, and no deadline: a busy machine is not a failing test.
settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=40)
settings.register_profile(
    "soak",
    deadline=None,
    max_examples=5_000,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
# `make mutants` asks only whether an example fails, not for the smallest.
settings.register_profile(
    "mutants", settings.get_profile("repeatable"), phases=(Phase.explicit, Phase.generate)
)
settings.load_profile("repeatable")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let a run take one lane of tests, and several processes."""
    add_option(parser)
    workers.add_options(parser)


def pytest_configure(config: pytest.Config) -> None:
    """Have tests on the real clock tried again, those of promises marked, one lane chosen."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        # So it is for what a shell runs beside itself (`make test &`), and so all processes that
        # tests start would inherit it, those among them that are to be interrupted.
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if (lane := config.getoption("--lane")) is not None:
        config.pluginmanager.register(OneLane(Lane(lane)), "lane")
    config.pluginmanager.register(Attempts(), "attempts")
    config.pluginmanager.register(PromisesMarked(), "promises")
    workers.configure(config)


class PromisesMarked:
    """Plugin of pytest: marks the tests that the table of promises names, before any are chosen."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Mark them."""
        named = tests_of_promises()
        for item in items:
            file = item.path.relative_to(TESTS).as_posix()
            if file in named or f"{file}::{_defined_as(item)}" in named:
                item.add_marker(pytest.mark.promise)


def _defined_as(item: pytest.Item) -> str:
    """Return the name at the top of its file that a test is collected from."""
    return item.nodeid.partition("::")[2].partition("::")[0].partition("[")[0]


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put files with tests on the real clock last, so that no computing goes on beside them."""
    on_real_clock = {item.path for item in items if item.get_closest_marker("realtime")}
    tests = Counter(item.path for item in items)
    items.sort(key=lambda item: (item.path in on_real_clock, -tests[item.path], item.path))


def pytest_asyncio_loop_factories(
    config: pytest.Config, item: pytest.Item
) -> Mapping[str, Callable[[], asyncio.AbstractEventLoop]]:
    """Give tests marked `virtual_clock` the virtual loop, all others the ordinary one."""
    if item.get_closest_marker("virtual_clock"):
        return {"virtual": VirtualLoop}
    return {"real": asyncio.new_event_loop}


@pytest.fixture(autouse=True, scope="session")
def _store_of_the_tests(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Keep servers that tests start away from the programs of whoever runs the tests."""
    os.environ[STORE_VARIABLE] = str(tmp_path_factory.mktemp("store") / "store.db")


@pytest.fixture(scope="session")
def programs_imported() -> None:
    """The programs that tests start by `warm_start` are imported.

    For the first test of a file that shares a cell: else the cell's start takes that, too.
    """
    import_programs()


@pytest.fixture
def virtual_loop() -> Iterator[VirtualLoop]:
    """A fresh virtual loop for a synchronous test that drives it itself."""
    loop = VirtualLoop()
    yield loop
    loop.close()


def pytest_collection_finish() -> None:
    """Take modules and items out of the garbage collector's sight, and let it look less often.

    They live as long as the run. Looking through them again and again took a tenth of the
    processor time of the server's tests, and looking at all that is young a thirtieth of what
    was left.
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000)
