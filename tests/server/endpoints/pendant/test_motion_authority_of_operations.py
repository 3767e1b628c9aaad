"""Who may ask for what: every operation by every role, in control and not, as its page says.

What is expected is read from docs/generated/operations.md alone; what is asked are the right
requests of tests/frozen/bodies.jsonl.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator
from enum import Enum
from functools import cache
from typing import Any

import pytest
from frozen import bodies_to_ask
from frozen.bodies_to_ask import RIGHT, ROLES, VISITOR, AskedCell, Question, read_steps
from frozen.frozen_files import BODIES, SCHEMAS
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.guarded_rig import log_in
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.server.access.audit import AuditEntry, AuditEvent
from openpendant.server.endpoints.pendant.authority_need import concerns_carried
from openpendant.server.events.effects import Effect, Send
from openpendant.server.events.management_requests import parse
from openpendant.server.scene.imports import SceneImport, read_apart
from openpendant.simplemsg import Overtaken, ReplyCode
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import Activity, Management
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.scene import ImportScene
from openpendant.simplemsg.verdicts import VerdictCode as V

ROW = re.compile(r"^\| \[`([\w.]+)`\]\(#\w+\) \| (\w+) \| ([^|]+) \|", re.MULTILINE)
RIGHTS = frozenset({V.LOGIN_NEEDED, V.ROLE_TOO_LOW, V.NOT_IN_CONTROL, V.HELD_BY_OTHER})
BOX: dict[str, Any] = {"name": "box", "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}}
TCP = {"position": [0.0, 0.0, 0.1]}


def beside_the_tool(way: float) -> list[float]:
    """Return a place in base, off the tip of a tool of `TCP` along y where the robot is at home."""
    robot = serial_robot("ur5")
    flange = Kinematics(robot).forward(robot.home_position)
    x, y, z = flange.compose(Pose.from_values((0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 1.0))).position
    return [float(x), float(y) + way, float(z)]


PROGRAM = 'openpendant-program/1\nprogram "main" robot ur5\nwait 3000 s\n'


class Situation(Enum):
    STANDING = "nothing moves, and nothing that is asked for is in use"
    IN_USE = "the tool that is asked for is selected, the object is carried"
    MOVING = "the robot moves"
    RUNNING = "a program that is asked for runs, and waits"


_BUSY = {Situation.MOVING, Situation.RUNNING}
WORDS: dict[str, set[Situation]] = {
    "never": set(),
    "always": set(Situation),
    "while the robot moves": _BUSY,
    "while the robot moves, or for what it carries": {*_BUSY, Situation.IN_USE},
    "for the selected tool": {Situation.IN_USE},
    "for a program under way": {Situation.RUNNING},
}
"""What the page says of when the authority is needed, and in which situations that is."""


@cache
def page() -> dict[str, tuple[str, str]]:
    """Return the least role and the need of the authority of each operation, as published."""
    text = (SCHEMAS.parent / "operations.md").read_text("utf-8")
    return {name: (role, when.strip()) for name, role, when in ROW.findall(text)}


@cache
def right_bodies() -> dict[str, dict[str, Any]]:
    steps = (step for _, step, _ in read_steps(BODIES) if isinstance(step, Question))
    right = (json.loads(step.bytes) for step in steps if step.name.endswith(RIGHT))
    return {body["op"]: body for body in right}


def body_in(situation: Situation, op: str) -> dict[str, Any]:
    """Return a request about what is in use where that is the situation; it harms nobody."""
    body = dict(right_bodies()[op])
    if op.startswith("users.") and "name" in body:
        body["name"] = "nobody else"
    if op == "scene.add" and situation is Situation.IN_USE:
        body["object"] = {**body["object"], "link": "wrist_3_link"}
    return body


def expected(op: str, role: str, control: str, situation: Situation) -> V | None:
    """Return the code that the page demands; None for none of the codes of rights.

    Args:
        control: who is in control: nobody, other or self.
    """
    least, when = page()[op]
    if least != "anybody" and ROLES.index(role) < ROLES.index(least):
        return V.LOGIN_NEEDED if role == VISITOR else V.ROLE_TOO_LOW
    if control == "self" or situation not in WORDS[when]:
        return None
    return V.HELD_BY_OTHER if control == "other" else V.NOT_IN_CONTROL


HERE = {**BOX, "position": beside_the_tool(-0.055)}


class PreparedCell(AskedCell):
    """A cell with a tool, an object and a program, and one more admin who takes the control."""

    def __init__(self, situation: Situation) -> None:
        super().__init__()
        self.situation = situation
        self.other = self._visitor()
        assert log_in(self.other, "admin") is V.ACCEPTED
        self.pendants["other"] = self.other
        self.control("other")
        self.do_all(
            {"op": "tools.add", "name": "torch", "tcp": TCP, "expected_revision": 0},
            {"op": "scene.add", "object": HERE, "expected_revision": 0},
            {"op": "programs.save", "name": "main", "body": PROGRAM, "expected_revision": 0},
        )
        if situation is Situation.IN_USE:
            self.do_all(
                {"op": "tools.select", "name": "torch", "expected_revision": 1},
                {"op": "scene.attach", "name": "box", "expected_revision": 1},
            )

    def do_all(self, *bodies: dict[str, Any]) -> None:
        for body in bodies:
            assert self.code("other", body) is None, body

    def control(self, who: str | None) -> None:
        """Have somebody in control, who moves the robot or runs the program; None for nobody."""
        if self.holder_of_control is not None:
            self.holder_of_control.release()
            self.holder_of_control = None
        while self.core.cell.under_way():
            self.pass_time(10)
        if who is None:
            return
        holder = self.holder_of_control = self.pendants[who]
        assert holder.take() is V.ACCEPTED
        self.pass_time(100)

    def begin(self) -> None:
        """Have the robot moved, or the program run, by who is in control."""
        holder = self.holder_of_control
        assert holder is not None
        match self.situation:
            case Situation.MOVING:
                first, *rest = self.position
                assert holder.move(first + 1.0, *rest, speed=0.002) is V.ACCEPTED
            case Situation.RUNNING:
                asked = messages.ProgramRun(holder._next(), 1, 0, 1, 0, 1.0, "main")
                assert holder.code(asked) is V.ACCEPTED
        self.pass_time(100)

    def holds(self) -> bool:
        """Return True if the situation is as it was made."""
        cell, environment = self.core.cell, self.core.environment
        assert environment is not None
        carried = [each.name for each in environment.world.scene.objects if each.link]
        match self.situation:
            case Situation.STANDING:
                return (environment.world.frames.selected_tool, carried) == (None, [])
            case Situation.IN_USE:
                return (environment.world.frames.selected_tool, carried) == ("torch", ["box"])
            case Situation.MOVING:
                return cell.is_moving
            case Situation.RUNNING:
                return cell.program is not None and not cell.is_moving

    def code(self, who: str, body: dict[str, Any]) -> V | None:
        """Ask; return the code of the refusal. One without the authority names its holder."""
        done, answer = self.ask(who, json.dumps(body).encode())
        if done:
            return None
        told = json.loads(answer)
        code = V(told["code"])
        if code is V.HELD_BY_OTHER:
            assert "admin is in control: take it once it is free" in told["text"]
        return code

    def asked(self, role: str, control: str) -> Iterator[tuple[str, V | None, V | None]]:
        """Yield each operation with the code of its answer, and the one that was to be expected."""
        for op in sorted(OPERATIONS, key=lambda each: each == "access.logout"):
            if control != "self":
                assert self.holds(), (op, role, control)
            code = self.code(role, body_in(self.situation, op))
            found = code if code in RIGHTS else None
            yield op, found, expected(op, role, control, self.situation)
        if role != VISITOR:
            assert log_in(self.pendants[role], role) is V.ACCEPTED


def test_the_page_has_every_operation_and_every_one_is_asked_for() -> None:
    assert page().keys() == OPERATIONS.keys() == right_bodies().keys()
    assert {when for _, when in page().values()} == WORDS.keys()


@pytest.mark.parametrize("situation", Situation, ids=lambda each: each.name.lower())
def test_every_operation_is_open_to_whom_the_page_says_and_to_nobody_else(
    situation: Situation,
) -> None:
    """No login, viewer, operator, programmer, admin × in control or not: 0 differences."""
    cell = PreparedCell(situation)
    differences: list[tuple[Any, ...]] = []
    counted: Counter[V | None] = Counter()

    def ask(role: str, control: str) -> None:
        for op, found, wanted in cell.asked(role, control):
            counted[found] += 1
            if found is not wanted:
                differences.append((op, role, control, situation.name, found, wanted))

    controls = ["other"] if situation in _BUSY else ["nobody", "other"]
    for control in controls:
        cell.control(None if control == "nobody" else "other")
        if control == "other":
            cell.begin()
        for role in ROLES:
            ask(role, control)
    for role in ROLES:
        cell.control(None)
        pendant = cell.pendants[role]
        if (refused := pendant.take()) is not V.ACCEPTED:
            # Neither without a login nor as a viewer is anybody ever in control.
            assert refused is (V.LOGIN_NEEDED if role == VISITOR else V.ROLE_TOO_LOW)
            assert role in (VISITOR, "viewer")
            continue
        cell.holder_of_control = pendant
        cell.begin()
        ask(role, "self")
    assert differences == []
    assert sum(counted.values()) == len(OPERATIONS) * (len(ROLES) * (len(controls) + 1) - 2)
    assert min(counted[V.LOGIN_NEEDED], counted[V.ROLE_TOO_LOW], counted[V.HELD_BY_OTHER]) > 0
    assert (counted[V.NOT_IN_CONTROL] > 0) == (situation not in _BUSY)


@pytest.mark.parametrize(
    "situation", [Situation.STANDING, Situation.IN_USE], ids=lambda each: each.name.lower()
)
def test_what_needs_the_authority_at_rest_is_refused_behind_a_stop_and_nothing_else(
    situation: Situation,
) -> None:
    differences = []
    for op in sorted(OPERATIONS):
        cell = PreparedCell(situation)
        assert cell.other.stop() is V.ACCEPTED
        request = Management(cell.other._next(), json.dumps(body_in(situation, op)).encode())
        before = len(cell.other.got)
        cell.other.send(Overtaken(request))
        told = [each for each in cell.other.got[before:] if isinstance(each, Management)]
        codes = [json.loads(each.body).get("code") for each in told]
        if (codes == [V.OVERTAKEN_BY_STOP]) != (situation in WORDS[page()[op][1]]):
            differences.append((op, codes))
    assert differences == []


# One by one, on a machine of its own where everybody has every right.


class SharedCell(EmulatedCell):
    """A cell with two pendants of which one is in control; a tool, two objects, one carried."""

    def __init__(self) -> None:
        super().__init__(has_surroundings=True, controller={"signals": "openpendant"})
        self.ann = self.holder("ann")
        self.bob = self.pendant("bob")
        for body in (
            {"op": "tools.add", "name": "torch", "tcp": TCP, "expected_revision": 0},
            {"op": "tools.add", "name": "spare", "tcp": TCP, "expected_revision": 1},
            {"op": "tools.select", "name": "torch", "expected_revision": 2},
            {"op": "scene.add", "object": HERE, "expected_revision": 0},
            {"op": "scene.attach", "name": "box", "expected_revision": 1},
            {"op": "scene.add", "object": LID, "expected_revision": 2},
        ):
            done, answer = self.ask(self.ann, body)
            assert done, answer
        self.wait(100)

    def ask(self, who: Pendant, body: dict[str, Any]) -> tuple[bool, dict[str, Any]]:
        request = Management(who._next(), json.dumps(body).encode())
        before = len(who.got)
        who.send(request)
        self.wait(100)
        (answer,) = [each for each in who.got[before:] if isinstance(each, Management)]
        return answer.reply_code == ReplyCode.SUCCESS, json.loads(answer.body)

    def refused(self, who: Pendant, body: dict[str, Any]) -> tuple[V, str]:
        before = self.kept()
        done, answer = self.ask(who, body)
        assert not done, answer
        assert self.kept() == before
        return V(answer["code"]), answer["text"]

    def kept(self) -> tuple[object, ...]:
        environment = self.core.environment
        assert environment is not None
        world, outputs = environment.world, environment.signals.outputs
        return outputs, world.frames.selected_tool, world.scene, dict(world.revisions)


LID: dict[str, Any] = {**BOX, "name": "lid", "position": beside_the_tool(0.055)}
LONG = {"position": [0.0, 0.0, 0.2]}
SCENE = {"schema": "openpendant-scene/1"}
TOOLS: dict[str, Any] = {"schema": "openpendant-frames/1", "tools": [], "selected_tool": None}
HELD = [
    ({"op": "signals.set", "output": 2, "value": True}, ""),
    ({"op": "tools.select", "name": None, "expected_revision": 3}, ""),
    ({"op": "tools.import", "content": TOOLS, "expected_revision": 3}, ""),
    (
        {"op": "tools.move", "name": "torch", "tcp": LONG, "expected_revision": 3},
        " for 'torch', the selected tool",
    ),
    ({"op": "scene.attach", "name": "lid", "expected_revision": 3}, ""),
    ({"op": "scene.detach", "name": "box", "expected_revision": 3}, ""),
    (
        {"op": "scene.remove", "name": "box", "expected_revision": 3},
        " for what the robot carries",
    ),
    (
        {
            "op": "scene.move",
            "name": "box",
            "pose": {"position": [0, 1, 0]},
            "expected_revision": 3,
        },
        " for what the robot carries",
    ),
    (
        {
            "op": "scene.add",
            "object": {**LID, "name": "cap", "position": [0, 0, 0], "link": "wrist_3_link"},
            "expected_revision": 3,
        },
        " for what the robot carries",
    ),
    (
        {"op": "scene.import", "content": SCENE, "expected_revision": 3},
        " for what the robot carries",
    ),
]
OPEN = [
    {"op": "tools.move", "name": "spare", "tcp": LONG, "expected_revision": 3},
    {"op": "scene.remove", "name": "lid", "expected_revision": 3},
    {
        "op": "scene.move",
        "name": "lid",
        "pose": {"position": [0, -1.5, 0]},
        "expected_revision": 3,
    },
    {"op": "scene.add", "object": {**LID, "name": "cap"}, "expected_revision": 3},
    {"op": "scene.allow", "first": "lid", "second": "box", "expected_revision": 3},
]


def named(body: Any) -> str:
    return str(body["op"]) if isinstance(body, dict) else "-"


@pytest.fixture
def cell() -> SharedCell:
    return SharedCell()


@pytest.mark.parametrize(("body", "what"), HELD, ids=named)
def test_what_acts_on_the_robot_is_refused_to_all_but_its_holder_whom_the_text_names(
    cell: SharedCell, body: dict[str, Any], what: str
) -> None:
    needs = f"{body['op']} needs the motion authority{what}"
    text = f"{needs}; ann is in control: take it once it is free"
    assert cell.refused(cell.bob, body) == (V.HELD_BY_OTHER, text)
    cell.ann.release()
    text = f"{needs}; nobody is in control: take it first"
    assert cell.refused(cell.bob, body) == (V.NOT_IN_CONTROL, text)
    assert cell.bob.take() is V.ACCEPTED
    done, answer = cell.ask(cell.bob, body)
    assert done, answer


@pytest.mark.parametrize("body", OPEN, ids=named)
def test_a_standing_robot_leaves_to_others_what_it_neither_carries_nor_works_with(
    cell: SharedCell, body: dict[str, Any]
) -> None:
    done, answer = cell.ask(cell.bob, body)
    assert done, answer


@pytest.mark.parametrize("by", ["motion", "program"])
@pytest.mark.parametrize("body", OPEN[1:], ids=named)
def test_while_the_robot_moves_the_scene_is_its_holders(
    cell: SharedCell, body: dict[str, Any], by: str
) -> None:
    if by == "motion":
        first, *rest = cell.position
        assert cell.ann.move(first + 1.0, *rest, speed=0.02) is V.ACCEPTED
        cell.wait(200)
        busy = "the robot is moving"
    else:
        saved = {"op": "programs.save", "name": "main", "body": PROGRAM, "expected_revision": 0}
        assert cell.ask(cell.ann, saved)[0]
        run = messages.ProgramRun(cell.ann._next(), 1, 0, 1, 0, 1.0, "main")
        assert cell.ann.code(run) is V.ACCEPTED
        busy = "program 'main' is under way"
    code, text = cell.refused(cell.bob, body)
    assert code is V.HELD_BY_OTHER
    assert text.startswith(f"{body['op']} needs the motion authority while {busy}; ann is in ")
    done, answer = cell.ask(cell.ann, body)
    assert done or answer["code"] == V.CHANGE_WHILE_MOVING
    assert done == (body["op"] == "scene.add")


def test_an_imported_scene_that_the_robot_would_carry_is_its_holders(cell: SharedCell) -> None:
    assert cell.ask(cell.ann, {"op": "scene.remove", "name": "box", "expected_revision": 3})[0]
    held = {**SCENE, "objects": [{**LID, "link": "wrist_3_link"}]}
    code, _ = cell.refused(
        cell.bob, {"op": "scene.import", "content": held, "expected_revision": 4}
    )
    assert code is V.HELD_BY_OTHER
    for content in ({**SCENE, "objects": [LID]}, {**SCENE, "objects": 5}):
        _, answer = cell.ask(
            cell.bob, {"op": "scene.import", "content": content, "expected_revision": 4}
        )
        assert answer.get("code") not in RIGHTS


@pytest.mark.parametrize("carried", [(), ("lid",)])
@pytest.mark.parametrize("objects", [[LID], [{**LID, "link": "wrist_3_link"}], 5, [5], []])
def test_a_scene_that_was_read_elsewhere_needs_the_authority_as_one_read_here(
    objects: object, carried: tuple[str, ...]
) -> None:
    body = {"op": "scene.import", "content": {**SCENE, "objects": objects}, "expected_revision": 4}
    data = json.dumps(body).encode()
    here, elsewhere = parse(data)[1], read_apart(data)[1]
    assert isinstance(here, ImportScene)
    assert isinstance(elsewhere, SceneImport)
    assert concerns_carried(elsewhere, carried) == concerns_carried(here, carried)


def test_breakpoints_of_a_program_under_way_are_its_holders(cell: SharedCell) -> None:
    saved = {"op": "programs.save", "name": "main", "body": PROGRAM, "expected_revision": 0}
    asked = {"op": "programs.breakpoints", "name": "main", "statements": [0]}
    assert cell.ask(cell.ann, saved)[0]
    assert cell.ask(cell.bob, asked)[0]
    run = messages.ProgramRun(cell.ann._next(), 1, 0, 1, 0, 1.0, "main")
    assert cell.ann.code(run) is V.ACCEPTED
    code, text = cell.refused(cell.bob, asked)
    assert code is V.HELD_BY_OTHER
    assert "for 'main', which is under way; ann is in control" in text
    assert cell.ask(cell.ann, asked)[0]


OUTPUT = {"op": "signals.set", "output": 2, "value": True}


def acted(cell: SharedCell, who: Pendant, after_ms: int) -> V | None:
    """Have a request carried out some time after it came; no tick comes between."""
    message = Management(who._next(), json.dumps(OUTPUT).encode())
    operation, asked = parse(message.body)
    now = cell.now + after_ms * 1_000_000
    requests = cell.core.pendants._management
    effects: list[Effect] = requests.answer(who.session, message, operation, asked, now)
    for effect in effects:
        if isinstance(effect, Send) and isinstance(effect.message, Management):
            return V(json.loads(effect.message.body)["code"])
    return None


def test_the_authority_is_judged_when_a_request_acts_not_when_it_came(cell: SharedCell) -> None:
    assert acted(cell, cell.ann, 0) is None
    assert acted(cell, cell.ann, 3_100) is V.NOT_IN_CONTROL
    cell.ann.release()
    assert acted(cell, cell.ann, 0) is V.NOT_IN_CONTROL
    cell.bob.take()
    assert acted(cell, cell.ann, 0) is V.HELD_BY_OTHER
    assert acted(cell, cell.bob, 0) is None


def test_the_authority_of_one_cell_is_none_of_another() -> None:
    here, there = SharedCell(), SharedCell()
    there.ann.release()
    assert here.ann.session == there.ann.session
    assert here.ask(here.ann, OUTPUT)[0]
    assert there.refused(there.ann, OUTPUT)[0] is V.NOT_IN_CONTROL
    here.ann.release()
    assert there.ann.take() is V.ACCEPTED
    assert there.ask(there.ann, OUTPUT)[0]
    assert here.refused(here.ann, OUTPUT)[0] is V.NOT_IN_CONTROL


def test_such_a_refusal_is_noted_with_who_what_and_why(monkeypatch: pytest.MonkeyPatch) -> None:
    log: list[AuditEntry] = []
    monkeypatch.setattr(bodies_to_ask, "_forget", log.append)
    cell = PreparedCell(Situation.STANDING)
    log.clear()
    assert cell.code("operator", OUTPUT) is V.HELD_BY_OTHER
    (refused,) = [each for each in log if each.event is AuditEvent.REFUSED]
    assert (refused.who, refused.role) == ("operator", "operator")
    assert refused.detail["wanted"] == "signals.set"
    assert refused.detail["code"] == V.HELD_BY_OTHER
    assert "admin is in control" in str(refused.detail["text"])


def test_a_stop_and_the_end_of_a_press_need_no_authority(cell: SharedCell) -> None:
    first, *rest = cell.position
    assert cell.ann.move(first + 1.0, *rest, speed=0.02) is V.ACCEPTED
    cell.wait(200)
    assert cell.bob.stop("a hand in the way") is V.ACCEPTED
    assert cell.bob.code(messages.JogRelease(cell.bob._next(), 1)) is V.NOTHING_TO_CONTROL
    cell.wait(2_000)
    assert cell.core.cell.activity is Activity.IDLE


CYCLE = """openpendant-program/1
program "cycle" robot ur5
set output 3 on
attach "lid"
wait 0.1 s
"""


def test_a_program_sets_outputs_and_takes_objects_for_its_owner(cell: SharedCell) -> None:
    saved = {"op": "programs.save", "name": "cycle", "body": CYCLE, "expected_revision": 0}
    assert cell.ask(cell.ann, saved)[0]
    run = messages.ProgramRun(cell.ann._next(), 1, 0, 1, 0, 1.0, "cycle")
    assert cell.ann.code(run) is V.ACCEPTED
    for _ in range(10):
        cell.ann.send(messages.AuthorityBeat())
        cell.wait(100)
    outputs, _, scene, _ = cell.kept()
    assert isinstance(outputs, tuple)
    assert outputs[3]
    assert "lid" in [each.name for each in getattr(scene, "objects", ()) if each.link]
