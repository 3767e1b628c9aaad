"""What `docs/minimum-controller.md` shows to the byte, and the size of the program beside it."""

import re
from pathlib import Path

import pytest
from rigs.peers.minimum_controller import CODEC, SOURCE, STOP

from openpendant.simplemsg import JointPosition, JointTrajPt, Message, Status, accepted, joint_array

PAGE = Path(__file__).parents[2] / "docs" / "minimum-controller.md"
JOINTS = joint_array((0.5, -1.5, 1.5, -1.5, -1.5, 0.0))
POINT = JointTrajPt(sequence=1, joints=JOINTS, velocity=0.25, duration=2.0)
SHOWN: list[Message] = [
    POINT,
    accepted(POINT),
    STOP,
    JointPosition(sequence=0, joints=JOINTS),
    Status(1, 0, 0, 0, 1, 2, 1),
]


@pytest.fixture(scope="module")
def frames() -> list[bytes]:
    block = re.search(r"```hex\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert block is not None
    return [bytes.fromhex(line) for line in block[1].splitlines()]


def test_the_bytes_on_the_page_are_the_messages_that_it_names(frames: list[bytes]) -> None:
    assert [CODEC.decode(frame) for frame in frames] == SHOWN
    assert [CODEC.encode(message) for message in SHOWN] == frames


def test_the_program_names_every_error_that_the_page_names() -> None:
    block = re.search(r"enum \{ (NO_ERROR = .*?)\}", SOURCE.read_text("utf-8"), re.DOTALL)
    assert block is not None
    numbers, last = set(), -1
    for name in block[1].split(","):
        _, _, value = name.partition("=")
        last = int(value) if value else last + 1
        numbers.add(last)
    named = {int(code) for code in re.findall(r"\*(1\d\d)\*", PAGE.read_text("utf-8"))}
    assert named == numbers - {0}


def test_the_program_fits_on_a_few_pages() -> None:
    lines = SOURCE.read_text("utf-8").splitlines()
    assert len(lines) <= 300
    assert [number for number, line in enumerate(lines, 1) if len(line) > 100] == []
