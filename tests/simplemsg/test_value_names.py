import pytest

from openpendant.simplemsg import JointFeedback, JointTrajPt, Message, Ping, Status
from openpendant.simplemsg.declaration import Real, value_name
from openpendant.simplemsg.motoman import MotomanMotionReply
from openpendant.simplemsg.pendant import Authority, Outcome, PoseMove, State, Verdict


@pytest.mark.parametrize(
    ("cls", "field", "value", "name"),
    [
        (JointTrajPt, "sequence", -4, "STOP"),
        (JointTrajPt, "sequence", 4, None),
        (Status, "in_error", -1, "UNKNOWN"),
        (Status, "mode", 2, "AUTO"),
        (Status, "error_code", 2, None),
        (JointFeedback, "valid_fields", 6, "POSITION|VELOCITY"),
        (JointFeedback, "valid_fields", 0x32, "POSITION|0x30"),
        (JointFeedback, "valid_fields", -1, "TIME|POSITION|VELOCITY|ACCELERATION|0xfffffff0"),
        (JointFeedback, "valid_fields", 0, None),
        (JointFeedback, "valid_fields", 0x30, None),
        (MotomanMotionReply, "command", 200111, "STOP_MOTION"),
        (MotomanMotionReply, "result", 5, "NOT_READY"),
        (MotomanMotionReply, "subcode", 5007, "NOT_READY_HOLD"),
        (PoseMove, "motion", 2, "LIN"),
        (Authority, "action", 1, "REQUEST"),
        (Verdict, "code", 45, "OUT_OF_RANGE"),
        (Outcome, "outcome", 1, "COMPLETED"),
        (State, "link", 2, "STALE"),
        (State, "valid_fields", 18, "POSITION|TOOL"),
    ],
)
def test_a_value_has_its_declared_name(
    cls: type[Message], field: str, value: int, name: str | None
) -> None:
    assert value_name(cls.FIELDS[field], value) == name


@pytest.mark.parametrize("value", ["STOP", 1.0, None])
def test_what_is_no_integer_has_no_name(value: object) -> None:
    assert value_name(Status.FIELDS["mode"], value) is None


def test_a_real_has_no_name() -> None:
    assert Ping.FIELDS == {}
    assert value_name(Real("speed"), 1.0) is None
