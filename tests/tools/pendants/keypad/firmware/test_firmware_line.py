"""Line of the compiled firmware as a program sees it: a terminal, its cable, the other USART."""

import os
import select
import time
from collections.abc import Callable, Iterator

import pytest
from rigs.firmware.simulated_board import QUIET, Board, frames_of

from openpendant.simplemsg.serial_frames import (
    Ack,
    AckResult,
    FrameReader,
    FromKeypad,
    KeyDown,
    KeypadBeat,
    KeypadHello,
    KeyUp,
    LcdPage,
    LineWay,
    bytes_of,
)

pytestmark = pytest.mark.firmware

PATIENCE = 20.0
RESET_BUTTON = 2


class Terminal:
    """What a bridge opens: the other end of the board's line."""

    def __init__(self, name: str) -> None:
        self.fd = os.open(name, os.O_RDWR | os.O_NOCTTY)
        self.frames: list[object] = []
        self._reader = FrameReader(LineWay.TO_HOST)

    def until(self, holds: Callable[[list[object]], bool]) -> None:
        """Read until something holds of what came."""
        end = time.monotonic() + PATIENCE
        while not holds(self.frames):
            assert time.monotonic() < end, self.frames
            if select.select([self.fd], [], [], 0.1)[0]:
                read = os.read(self.fd, 4096)
                self.frames += [frame for _, frame in self._reader.receive(read)]

    def write(self, frame: LcdPage, sequence: int) -> None:
        os.write(self.fd, bytes_of(frame, sequence))

    def is_dead(self) -> bool:
        """Return True once reading ends, as it does when the cable is out."""
        try:
            while os.read(self.fd, 4096):
                pass
        except OSError:
            pass
        return True

    def close(self) -> None:
        os.close(self.fd)


def has(kind: type[FromKeypad]) -> Callable[[list[object]], bool]:
    return lambda frames: any(isinstance(frame, kind) for frame in frames)


@pytest.fixture
def plugged(board: Board) -> Iterator[Terminal]:
    """The terminal of a board whose time goes with the clock."""
    board.run(QUIET)
    terminal = Terminal(board.order("plug")["pty"])
    board.order("live")
    yield terminal
    terminal.close()


def test_opening_the_port_resets_the_board(plugged: Terminal) -> None:
    plugged.until(has(KeypadHello))
    assert isinstance(plugged.frames[0], KeypadHello)
    assert plugged.frames[0].reset_cause == RESET_BUTTON


def test_a_page_goes_through_a_terminal(board: Board, plugged: Terminal) -> None:
    plugged.until(has(KeypadHello))
    plugged.write(LcdPage(b"x" * 80), 9)
    plugged.until(lambda frames: Ack(9, AckResult.DONE) in frames)
    time.sleep(0.1)
    assert board.lcd() == ["x" * 20] * 4


def test_a_pulled_cable_is_the_end_of_the_port_and_a_key_held_meanwhile_is_not_let_go(
    board: Board, plugged: Terminal
) -> None:
    plugged.until(has(KeypadHello))
    board.down(3)
    plugged.until(has(KeyDown))
    board.order("pull")
    assert plugged.is_dead()
    again = Terminal(board.order("plug")["pty"])
    again.until(lambda frames: sum(isinstance(frame, KeypadBeat) for frame in frames) >= 6)
    held = list(again.frames)
    board.up(3)
    again.until(lambda frames: KeyUp in [type(frame) for frame in frames])
    again.close()
    assert has(KeypadHello)(held)
    assert not has(KeyUp)(held)


def test_nothing_of_what_nobody_read_is_kept(board: Board) -> None:
    name = board.order("plug")["pty"]
    board.order("live")
    time.sleep(0.5)
    terminal = Terminal(name)
    terminal.until(has(KeypadHello))
    time.sleep(0.05)
    terminal.close()
    assert sum(isinstance(frame, KeypadBeat) for frame in terminal.frames) <= 2


def test_the_jumper_on_d49_moves_the_line_to_d18_and_d19(board: Board) -> None:
    board.order("pins", 1)
    board.order("reset")
    board.listen()
    on_usb = board.run(QUIET)
    board.order("line", 1)
    board.send(LcdPage(b"y" * 80))
    came = board.run(QUIET)
    assert on_usb == []
    assert frames_of(came, KeypadBeat)
    assert Ack(0, AckResult.DONE) in frames_of(came, Ack)
    assert board.lcd() == ["y" * 20] * 4
