"""Promise 28: frames that come twice, late, from elsewhere or on a lease that is gone.

Each is refused with a code of the catalogue, nothing is sent to the robot and nobody's authority
changes; exact on the rig's clock. What TLS does about single records is `test_exposure`' subject.
"""

import json
from collections.abc import Callable

import pytest
from rigs.cells.guarded_rig import GuardedRig, log_in
from rigs.peers.server_clients import NEAR, UPRIGHT, Pendant

from openpendant.server.access.request_gate import IN_ORDER, OF_MESSAGE, permission_of
from openpendant.server.events.effects import SendToController
from openpendant.server.events.management_requests import parse
from openpendant.simplemsg import Message, joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V

JOINTS = joint_array((0.5, 0.5))
RATES = joint_array((1.0, 0.0))

Frame = Callable[[int], Message]
"""Makes a frame with a request id."""


def operation(**body: object) -> Frame:
    return lambda number: messages.Management(number, json.dumps(body).encode())


def press(number: int, press: int = 1, state: int = 1) -> Message:
    return messages.JogStart(number, press, state, 0.15, messages.JogSpace.JOINTS, "", 2, RATES)


FRAMES: dict[str, Frame] = {
    "take control": lambda number: messages.Authority(number, messages.AuthorityAction.REQUEST),
    "take over": lambda number: messages.Authority(number, messages.AuthorityAction.FORCE),
    "joint move": lambda number: messages.JointMove(number, 0.5, 2, JOINTS),
    "joint path": lambda number: messages.JointPath(
        number, 0.5, 2, (messages.JointWaypoint(JOINTS),)
    ),
    "pose move": lambda number: messages.PoseMove(number, 1, 0.5, "base", NEAR, UPRIGHT),
    "pose path": lambda number: messages.PosePath(
        number, 1, 0.5, "base", (messages.PoseWaypoint(NEAR, UPRIGHT),)
    ),
    "home": lambda number: messages.Home(number, 0.5, "home"),
    "execute": lambda number: messages.Execute(number, 1, 0),
    "jog press": press,
    "jog step": lambda number: messages.JogStep(
        number, 0.5, messages.JogSpace.JOINTS, "", 2, joint_array((0.01,))
    ),
    "prepare": lambda number: messages.Prepare(number, messages.PrepareAction.PREPARE, 0),
    "jog undo": lambda number: messages.JogUndo(number, 0.5),
    "speed": lambda number: messages.SetSpeed(number, 0.5, 0.0),
    "resume": lambda number: messages.MotionControl(number, messages.MotionControlAction.RESUME),
    "program": lambda number: messages.ProgramRun(number, 1, 0, 1, 0, 1.0, "nothing"),
    "reset": lambda number: messages.ResetStop(number),
    "mode": lambda number: messages.SetMode(number, messages.OperatingMode.AUTOMATIC),
    "play": operation(op="recordings.play", name="nothing"),
    "output": operation(op="signals.set", name="gripper", value=True),
}
"""Everything that can move something; what may not be asked without the authority behind it."""

NEEDS_AUTHORITY = [
    name for name in FRAMES if name not in ("take control", "take over", "play", "output")
]


def code_of(pendant: Pendant, message: Message) -> V:
    for answer in pendant.send(message):
        match answer:
            case messages.Verdict(code=code):
                return V(code)
            case messages.Management(body=body):
                return V(json.loads(body).get("code", 0))
    raise AssertionError("no answer")


def points(rig: GuardedRig) -> int:
    return sum(isinstance(item, SendToController) for _, item in rig.log)


def test_the_table_has_every_request_that_can_move_something() -> None:
    tried = {type(frame(1)) for frame in FRAMES.values()} - {messages.Management}
    assert tried == {kind for kind, need in OF_MESSAGE.items() if need in IN_ORDER}
    for frame in FRAMES.values():
        message = frame(1)
        if isinstance(message, messages.Management):
            assert OPERATIONS[parse(message.body)[0]].IN_ORDER
        else:
            assert permission_of(message) in IN_ORDER


@pytest.mark.parametrize("name", FRAMES)
def test_promise_28_a_frame_that_comes_twice_or_late_is_refused(rig: GuardedRig, name: str) -> None:
    ann = rig.user("ann")
    ann.take()
    assert ann.code(messages.JointMove(50, 0.5, 2, JOINTS)) is V.ACCEPTED
    rig.wait(3_000)
    found = {}
    for how, offset in {"replayed": 0, "swapped": -1, "reordered": -5}.items():
        before = points(rig)
        code = code_of(ann, FRAMES[name](50 + offset))
        rig.wait(150)
        found[how] = (code, points(rig) - before)
    assert found == dict.fromkeys(found, (V.REQUEST_REPEATED, 0))
    assert code_of(ann, FRAMES[name](51)) is not V.REQUEST_REPEATED


@pytest.mark.parametrize("name", FRAMES)
def test_promise_28_a_frame_pasted_on_a_connection_without_login_is_refused(
    rig: GuardedRig, name: str
) -> None:
    otto, thief = rig.user("otto"), rig.visitor()
    otto.take()
    before = points(rig)
    assert code_of(thief, FRAMES[name](7)) is V.LOGIN_NEEDED
    assert points(rig) == before
    assert rig.core.cell.authority.is_held_by(otto.session)


@pytest.mark.parametrize("name", NEEDS_AUTHORITY)
def test_promise_28_a_frame_pasted_on_another_users_connection_is_refused(
    rig: GuardedRig, otto: Pendant, name: str
) -> None:
    ann = rig.user("ann")
    before = points(rig)
    code = code_of(ann, FRAMES[name](7))
    assert code in {V.HELD_BY_OTHER, V.NOT_IN_CONTROL, V.PRESS_STALE}, CATALOGUE[code]
    assert points(rig) == before
    assert rig.core.cell.authority.is_held_by(otto.session)


@pytest.mark.parametrize("ending", ["expired", "released", "reconnected"])
@pytest.mark.parametrize("name", NEEDS_AUTHORITY)
def test_promise_28_a_frame_on_a_lease_that_is_gone_is_refused(
    rig: GuardedRig, otto: Pendant, name: str, ending: str
) -> None:
    """Promise 18 too: the lease expires after 3 s without a beat."""
    match ending:
        case "expired":
            rig.wait(3_010)
        case "released":
            otto.release()
        case "reconnected":
            otto.close()
            otto = rig.user("otto")
    before = points(rig)
    code = code_of(otto, FRAMES[name](60))
    assert code in {V.NOT_IN_CONTROL, V.PRESS_STALE}, CATALOGUE[code]
    assert points(rig) == before
    otto.send(messages.AuthorityBeat())
    assert rig.core.cell.authority.holder is None


# Topics have no answer: they are not obeyed.


def held_press(rig: GuardedRig) -> Pendant:
    """Return an operator who holds press 1 in T1 and has sent its beat 1."""
    otto = rig.visitor(state_rate=50.0)
    assert log_in(otto, "otto") is V.ACCEPTED
    otto.take()
    assert otto.code(messages.SetMode(20, messages.OperatingMode.MANUAL_REDUCED)) is V.ACCEPTED
    rig.wait(30)
    otto.send(messages.Enabling(1))
    assert otto.code(press(21, 1, otto.all(messages.State)[-1].sequence)) is V.ACCEPTED
    otto.send(messages.JogBeat(1, 1))
    return otto


def keep_pressing(rig: GuardedRig, sender: Pendant, beat: Message, holder: Pendant) -> None:
    for _ in range(6):
        rig.wait(50)
        holder.send(messages.Enabling(1))
        sender.send(beat)


@pytest.mark.parametrize(
    "beat", [messages.JogBeat(1, 1), messages.JogBeat(1, 0), messages.JogBeat(2, 9)]
)
def test_promise_28_replayed_reordered_and_foreign_beats_hold_no_press(
    rig: GuardedRig, beat: messages.JogBeat
) -> None:
    otto = held_press(rig)
    keep_pressing(rig, otto, beat, otto)
    assert [end.reason for end in otto.all(messages.JogEnded)] == [messages.JogEnd.SILENT]


def test_promise_28_beats_from_another_connection_hold_no_press(rig: GuardedRig) -> None:
    otto, ann = held_press(rig), rig.user("ann")
    for number in range(2, 10):
        keep_pressing(rig, ann, messages.JogBeat(1, number), otto)
    assert [end.reason for end in otto.all(messages.JogEnded)] == [messages.JogEnd.SILENT]


def test_promise_28_a_press_that_ended_is_not_begun_again(rig: GuardedRig) -> None:
    """With a new request id and a fresh state: its number is used up."""
    otto = held_press(rig)
    otto.code(messages.JogRelease(22, 1))
    rig.wait(1_000)
    otto.send(messages.Enabling(1))
    fresh = otto.all(messages.State)[-1].sequence
    before = points(rig)
    assert otto.code(press(23, 1, fresh)) is V.PRESS_DEAD
    assert otto.code(press(24, 2, 1)) is V.PRESS_STALE
    assert points(rig) == before


def test_promise_28_a_lease_that_ends_during_a_press_ends_the_press(rig: GuardedRig) -> None:
    otto = held_press(rig)
    rig.wait(50)
    otto.release()
    rig.wait(500)
    before = points(rig)
    for number in range(2, 12):
        otto.send(messages.JogBeat(1, number))
        otto.send(messages.Enabling(1))
        otto.send(messages.AuthorityBeat())
        rig.wait(50)
    assert points(rig) == before
    assert rig.core.cell.authority.holder is None
