import pytest

from openpendant.simplemsg.motoman import IoResult, MotionCommand, MotionResult, Subcode
from openpendant.simplemsg.motoman_catalogue import CATALOGUE, explain

NUMBERS = {
    MotionCommand: {200101, 200102, 200111, 200112, 200113, 200114, 200121, 200122, 200130},
    MotionResult: set(range(7)),
    Subcode: {*range(3000, 3007), *range(3010, 3018), *range(5000, 5013)},
    IoResult: {0, *range(1001, 1006)},
}
"""Every number of MotoROS 1.9.12."""


@pytest.mark.parametrize("kind", NUMBERS)
def test_every_number_has_a_name_a_meaning_and_a_remedy(kind: type[MotionCommand]) -> None:
    assert {int(member) for member in kind} == NUMBERS[kind]
    assert set(CATALOGUE[kind]) == set(kind)
    assert all(entry.cause and entry.remedy for entry in CATALOGUE[kind].values())


@pytest.mark.parametrize(
    ("number", "member"),
    [
        (200102, MotionCommand.CHECK_QUEUE_CNT),
        (200121, MotionCommand.START_TRAJ_MODE),
        (1, MotionResult.BUSY),
        (5, MotionResult.NOT_READY),
        (3006, Subcode.INVALID_COMMAND),
        (3010, Subcode.INVALID_DATA),
        (3011, Subcode.INVALID_START_POSITION),
        (3014, Subcode.INVALID_ACCELERATION),
        (3015, Subcode.INVALID_INSUFFICIENT_FIELDS),
        (3017, Subcode.INVALID_TOOL),
        (5003, Subcode.NOT_READY_EMERGENCY_STOP),
        (5009, Subcode.NOT_READY_NOT_WAITING),
        (5012, Subcode.NOT_READY_INCREMENT_REJECTED),
        (1003, IoResult.WRITE_VALUE_INVALID),
    ],
)
def test_a_number_is_what_the_controller_program_means_by_it(number: int, member: object) -> None:
    assert member == number


def test_a_reason_goes_before_the_result() -> None:
    told = explain(MotionCommand.START_TRAJ_MODE, MotionResult.NOT_READY, 5007)
    assert told.name == "NOT_READY/NOT_READY_HOLD"
    assert told.meaning == "Hold is active."


def test_readiness_is_denied_with_a_reason_too() -> None:
    told = explain(MotionCommand.CHECK_MOTION_READY, MotionResult.FAILURE, 5003)
    assert told.name == "FAILURE/NOT_READY_EMERGENCY_STOP"


@pytest.mark.parametrize("queued", [0, 200, 3001, 5007])
def test_a_subcode_of_the_queue_check_is_a_count(queued: int) -> None:
    told = explain(MotionCommand.CHECK_QUEUE_CNT, MotionResult.SUCCESS, queued)
    assert told.name == "SUCCESS"
    assert told.meaning == f"{queued} increments of the group are queued."


def test_a_failed_queue_check_says_what_to_do() -> None:
    told = explain(MotionCommand.CHECK_QUEUE_CNT, MotionResult.FAILURE, -1)
    assert told.name == "FAILURE"
    assert "group" in told.remedy


@pytest.mark.parametrize("subcode", [0, 77, -1])
def test_without_a_known_reason_the_result_is_explained(subcode: int) -> None:
    assert explain(2016, MotionResult.BUSY, subcode).name == "BUSY"


def test_an_unknown_result_keeps_its_number() -> None:
    assert explain(14, 9, 3004).name == "result 9"
