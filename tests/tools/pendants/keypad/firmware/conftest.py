"""The compiled firmware and the simulated board that the tests here share."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from rigs.firmware.simulated_board import (
    QUIET,
    Board,
    Firmware,
    compiled_board,
    skip_without_tools,
)

StartBoard = Callable[..., Board]


@pytest.fixture(autouse=True)
def _has_tools(request: pytest.FixtureRequest) -> None:
    if request.node.get_closest_marker("firmware"):
        skip_without_tools()


@pytest.fixture(scope="session")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Firmware:
    skip_without_tools()
    return Firmware.compiled(tmp_path_factory.mktemp("firmware"))


@pytest.fixture(scope="session")
def board_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    skip_without_tools()
    return compiled_board(tmp_path_factory.mktemp("board"))


@pytest.fixture
def start_board(firmware: Firmware, board_program: Path) -> Iterator[StartBoard]:
    """Start boards that end with the test."""
    with ExitStack() as stack:

        def start(other: Firmware | None = None, baud: int = 115_200) -> Board:
            board = Board.started(board_program, other or firmware, baud)
            return stack.enter_context(board)

        yield start


@pytest.fixture
def board(start_board: StartBoard) -> Board:
    """A board just switched on."""
    return start_board()


@pytest.fixture
def ready(board: Board) -> Board:
    """A board that a bridge has greeted; all its keys are up."""
    board.run(QUIET)
    board.welcome()
    board.raw.clear()
    board.log.clear()
    return board
