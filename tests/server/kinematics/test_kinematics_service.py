"""Questions on kinematics as a pendant asks them, on the virtual clock."""

import itertools
import json
import math
from typing import Any

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import ready
from rigs.motion.loaded_robots import arm, serial_robot

from openpendant.motion.kinematics.ik.configuration import configuration_of
from openpendant.motion.kinematics.ik.singularity import dexterity
from openpendant.motion.kinematics.serial import Kinematics, with_tool
from openpendant.motion.orientation import roll_pitch_yaw
from openpendant.motion.pose import Pose
from openpendant.server.events.effects import Ask, Cancel
from openpendant.server.events.events import Closed, Received
from openpendant.server.planning.jobs import KinematicsQuestion, PlanAnswer
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import Capability, HelloReply, Management
from openpendant.simplemsg.verdicts import VerdictCode as V

HOME = serial_robot("ur5").home_position
BENT = (0.1, -1.2, 1.3, -1.4, -1.5, 0.6)
TCP = {"position": [0.01, 0.02, 0.1], "orientation": [0.0, 0.0, 1.0, 0.0]}
BOX = {"type": "box", "size": [0.3, 0.3, 0.3]}


class AskedCell:
    """A cell with surroundings, a pendant that looks on, and one in control."""

    def __init__(self, robot: str = "ur5") -> None:
        self.cell = EmulatedCell(robot, has_surroundings=True)
        self.pendant = self.cell.stranger()
        (welcome,) = (m for m in self.pendant.hello() if isinstance(m, HelloReply))
        self.offers = Capability(welcome.capabilities)
        self.cell.wait(50)

    def ask(self, op: str, **fields: Any) -> dict[str, Any]:
        """Ask once the rate allows it; return the answer, which may be a refusal."""
        self.cell.wait(1_000)
        return self.pendant.ask(f"kinematics.{op}", **fields)

    def has(self, *requests: dict[str, Any]) -> None:
        owner = self.cell.holder()
        for body in requests:
            answer = owner.ask(body.pop("op"), **body)
            assert "code" not in answer, answer
            self.cell.wait(100)
        owner.release()


@pytest.fixture(scope="module")
def asked() -> AskedCell:
    """A UR5 at home with the tool `torch` selected, the tool `stick`, the frame `table`, a box."""
    cell = AskedCell()
    cell.has(
        {"op": "tools.add", "name": "stick", "tcp": {"position": [0, 0, 0.3]}, **at(0)},
        {"op": "tools.add", "name": "torch", "tcp": TCP, **at(1)},
        {"op": "tools.select", "name": "torch", **at(2)},
        {"op": "frames.add", "name": "table", "pose": {"position": [0.5, 0.0, 0.1]}, **at(0)},
        {
            "op": "scene.add",
            "object": {"name": "box", "shape": BOX, "position": [-0.45, -0.1, 0.43]},
            **at(0),
        },
    )
    return cell


def at(revision: int) -> dict[str, int]:
    return {"expected_revision": revision}


def torch() -> Kinematics:
    tcp = Pose.from_values(TCP["position"], TCP["orientation"])
    return Kinematics(with_tool(serial_robot("ur5"), tcp))


def test_the_capability_is_offered(asked: AskedCell) -> None:
    assert Capability.KINEMATICS in asked.offers


def test_a_cell_without_surroundings_offers_no_kinematics_and_refuses_them() -> None:
    pendant = ready().stranger()
    (welcome,) = (m for m in pendant.hello() if isinstance(m, HelloReply))
    assert Capability.KINEMATICS not in Capability(welcome.capabilities)
    assert pendant.ask("kinematics.fk")["code"] == V.BAD_ARGUMENT


def test_fk_tells_the_pose_in_each_form(asked: AskedCell) -> None:
    told = asked.ask("fk", joints=BENT)
    pose = torch().forward(BENT)
    assert told["position"] == pytest.approx(pose.position.tolist(), abs=1e-12)
    assert told["orientation"] == pytest.approx(pose.quaternion.tolist(), abs=1e-12)
    assert told["orientation"][3] >= 0.0
    assert np.array(told["matrix"]) == pytest.approx(pose.to_matrix(), abs=1e-12)
    assert told["rpy"] == pytest.approx(roll_pitch_yaw(pose.rotation).tolist(), abs=1e-12)
    assert told["rpy_unique"]
    angle = math.hypot(*told["axis_angle"])
    assert math.cos(angle / 2.0) == pytest.approx(told["orientation"][3], abs=1e-12)
    assert told["limits"] == []
    assert "links" not in told


def test_fk_tells_how_the_arm_stands(asked: AskedCell) -> None:
    flags = configuration_of(torch(), BENT)
    assert flags is not None
    assert asked.ask("fk", joints=BENT)["configuration"] == {
        "shoulder": flags.shoulder,
        "elbow": flags.elbow,
        "wrist": flags.wrist,
        "turns": [0] * 6,
    }


def test_fk_without_joints_is_about_where_the_robot_is_reported(asked: AskedCell) -> None:
    told = asked.ask("fk")
    position = asked.cell.core.cell.feedback.standing_at
    assert told["position"] == pytest.approx(torch().forward(position).position.tolist())


def test_fk_in_a_user_frame_is_where_frames_transform_says(asked: AskedCell) -> None:
    in_base = asked.ask("fk", joints=BENT)
    told = asked.ask("fk", joints=BENT, frame="table")
    shift = np.subtract(told["position"], in_base["position"])
    assert shift == pytest.approx([-0.5, 0.0, -0.1], abs=1e-12)


def test_fk_of_a_named_tool_and_of_the_flange(asked: AskedCell) -> None:
    flange = asked.ask("fk", joints=BENT, tool="flange")
    stick = asked.ask("fk", joints=BENT, tool="stick")
    bare = arm("ur5").forward(BENT)
    assert flange["position"] == pytest.approx(bare.position.tolist(), abs=1e-12)
    tip = bare.compose(Pose.from_values((0.0, 0.0, 0.3), (0.0, 0.0, 0.0, 1.0)))
    assert stick["position"] == pytest.approx(tip.position.tolist(), abs=1e-12)


def test_fk_of_a_link_and_of_all_links(asked: AskedCell) -> None:
    elbow = asked.ask("fk", joints=BENT, link="forearm_link")
    there = arm("ur5").forward(BENT, link="forearm_link")
    assert elbow["position"] == pytest.approx(there.position.tolist(), abs=1e-12)
    links = asked.ask("fk", joints=BENT, all_links=True)["links"]
    assert [each["link"] for each in links] == list(serial_robot("ur5").links)
    place = {each["link"]: each["position"] for each in links}
    assert place["forearm_link"] == elbow["position"]


def test_fk_beyond_a_limit_tells_the_pose_and_the_joint(asked: AskedCell) -> None:
    told = asked.ask("fk", joints=(0.0, 0.0, 4.0, 0.0, 0.0, 0.0))
    limits = serial_robot("ur5").limits
    assert told["limits"] == [
        {"joint": 2, "value": 4.0, "lower": limits.lower[2], "upper": limits.upper[2]}
    ]


def test_at_a_pitch_of_a_right_angle_the_roll_is_0_and_the_angles_are_not_unique(
    asked: AskedCell,
) -> None:
    """The frame's z is turned into the tool's x, whatever the arm does."""
    rotation = Pose.from_rpy((0.0, 0.0, 0.0), (0.3, math.pi / 2.0, 0.8))
    pose = {"position": [-0.4, -0.2, 0.5], "orientation": rotation.quaternion.tolist()}
    (solution,) = asked.ask("ik", pose=pose, tool="flange")["solutions"]
    told = asked.ask("fk", joints=solution["joints"], tool="flange")
    # An answer is right to 1e-5 only; what is exactly so is the robot that holds its tool upright.
    assert told["rpy"][1] == pytest.approx(math.pi / 2.0, abs=1e-3)
    upright = AskedCell("abb_irb2400").ask("fk", joints=(0.0,) * 6)
    assert not upright["rpy_unique"]
    assert upright["rpy"] == pytest.approx([0.0, math.pi / 2.0, 0.0], abs=1e-9)
    assert upright["rpy"][0] == 0.0


def test_the_jacobian_and_its_numbers_are_the_librarys_to_the_last_bit(asked: AskedCell) -> None:
    kinematics = torch()
    told = asked.ask("jacobian", joints=BENT)
    about = dexterity(kinematics, BENT)
    assert told == {
        "jacobian": kinematics.jacobian(BENT).tolist(),
        "order": "linear-first",
        "condition": about.condition,
        "manipulability": about.manipulability,
        "nearest_singularity": {
            "kind": about.kind,
            "distance": about.distance,
            "unit": about.unit,
            "joints": [kinematics.limits.names.index(name) for name in about.joints],
        },
        "size": kinematics.size,
    }
    in_root = asked.ask("jacobian", joints=BENT, frame="root")
    assert in_root["jacobian"] == kinematics.jacobian(BENT, "root").tolist()


def test_the_jacobian_is_the_derivative_of_fk_linear_rows_first(asked: AskedCell) -> None:
    step, told = 1e-5, asked.ask("jacobian", joints=BENT)
    kinematics = torch()
    for joint in range(6):
        ends = [[q + sign * step * (j == joint) for j, q in enumerate(BENT)] for sign in (-1, 1)]
        before, after = map(kinematics.forward, ends)
        speed = (after.position - before.position) / (2.0 * step)
        assert [row[joint] for row in told["jacobian"][:3]] == pytest.approx(speed, abs=1e-8)


def test_the_condition_of_a_singular_arm_is_null(asked: AskedCell) -> None:
    told = asked.ask("jacobian", joints=(0.0,) * 6)
    assert told["condition"] is None
    assert told["nearest_singularity"]["kind"] in ("wrist", "elbow")


def pose_at(asked: AskedCell, joints: tuple[float, ...], **fields: Any) -> dict[str, Any]:
    told = asked.ask("fk", joints=joints, **fields)
    return {"position": told["position"], "orientation": told["orientation"]}


@pytest.mark.parametrize("fields", [{}, {"frame": "table"}, {"tool": "stick"}, {"frame": "root"}])
def test_ik_undoes_fk(asked: AskedCell, fields: dict[str, str]) -> None:
    told = asked.ask("ik", pose=pose_at(asked, BENT, **fields), seed=BENT, **fields)
    (solution,) = told["solutions"]
    assert (told["total"], told["complete"]) == (1, False)
    assert solution["joints"] == pytest.approx(BENT, abs=1e-5)
    assert solution["distance"] == pytest.approx(0.0, abs=1e-5)
    assert (solution["branch"], solution["touches"]) == (1, None)
    assert solution["position_error"] <= 1e-5
    assert solution["rotation_error"] <= 1e-4


def test_all_has_each_configuration_once_the_nearest_first(asked: AskedCell) -> None:
    told = asked.ask("ik", pose=pose_at(asked, BENT), seed=BENT, branches="all")
    solutions = told["solutions"]
    assert (told["total"], told["complete"]) == (8, True)
    assert sorted(each["branch"] for each in solutions) == list(range(1, 9))
    distances = [each["distance"] for each in solutions]
    assert distances == sorted(distances)
    flags = [json.dumps(each["configuration"] | {"turns": None}) for each in solutions]
    assert len({*flags}) == 8
    assert solutions[0]["joints"] == pytest.approx(BENT, abs=1e-6)
    kinematics = torch()
    for each in solutions:
        reached = kinematics.forward(each["joints"])
        assert reached.position_distance(kinematics.forward(BENT)) <= 1e-5
        changes = [abs(a - b) for a, b in zip(each["joints"], BENT, strict=True)]
        assert each["distance"] == max(changes)
        # At the turn that is nearest, where the limits allow it: half a turn but for the elbow.
        assert max(change for joint, change in enumerate(changes) if joint != 2) <= math.pi + 1e-9


def test_turns_has_every_full_turn_and_at_most_64_of_them(asked: AskedCell) -> None:
    told = asked.ask("ik", pose=pose_at(asked, BENT), seed=BENT, branches="turns")
    solutions = told["solutions"]
    assert (len(solutions), told["total"], told["complete"]) == (64, 8 * 2**5, True)
    limits = serial_robot("ur5").limits
    for each in solutions:
        limits.check_position(each["joints"])
    assert {each["branch"] for each in solutions} <= {*range(1, 9)}
    firsts = [each for each in solutions if each["branch"] == 1]
    for one, other in itertools.combinations(firsts, 2):
        apart = np.subtract(one["joints"], other["joints"]) / (2.0 * math.pi)
        assert apart == pytest.approx(np.round(apart), abs=1e-6)
        assert np.abs(apart).max() > 0.5


def test_a_solution_names_the_joint_nearest_to_its_limit(asked: AskedCell) -> None:
    joints = (0.1, -1.2, 3.0, -1.4, -1.5, 0.6)
    (solution,) = asked.ask("ik", pose=pose_at(asked, joints), seed=joints)["solutions"]
    nearest = solution["nearest_limit"]
    assert nearest["joint"] == 2
    assert nearest["margin"] == pytest.approx(serial_robot("ur5").limits.upper[2] - 3.0, abs=1e-5)


def test_what_an_answer_touches_is_told_where_it_is_asked_for(asked: AskedCell) -> None:
    pose = pose_at(asked, HOME)
    (blind,) = asked.ask("ik", pose=pose, seed=HOME)["solutions"]
    (seeing,) = asked.ask("ik", pose=pose, seed=HOME, scene=True)["solutions"]
    assert blind["touches"] is None
    assert "box" in seeing["touches"]
    assert len(seeing["touches"]) == 2
    aside = pose_at(asked, (1.6, *HOME[1:]))
    (free,) = asked.ask("ik", pose=aside, seed=(1.6, *HOME[1:]), scene=True)["solutions"]
    assert free["touches"] is None


def test_a_family_of_answers_is_not_complete() -> None:
    spare = AskedCell("kuka_iiwa14")
    home = serial_robot("kuka_iiwa14").home_position
    told = spare.ask("ik", pose=pose_at(spare, home), seed=home, branches="all")
    assert told["complete"] is False
    assert 2 <= len(told["solutions"]) == told["total"] <= 64
    assert told["solutions"][0]["configuration"] is None


def test_at_a_wrist_singularity_the_answers_are_not_complete(asked: AskedCell) -> None:
    flat = (0.1, -1.2, 1.3, -1.4, 0.0, 0.6)
    told = asked.ask("ik", pose=pose_at(asked, flat), seed=flat, branches="all")
    assert told["complete"] is False


REFUSED = [
    ("fk", {"joints": [0.0]}, V.WRONG_JOINT_COUNT),
    ("fk", {"joints": [1001.0, *[0.0] * 5]}, V.BAD_ARGUMENT),
    ("fk", {"frame": "nowhere"}, V.UNKNOWN_FRAME),
    ("fk", {"frame": "flange"}, V.BAD_ARGUMENT),
    ("fk", {"tool": "nothing"}, V.UNKNOWN_FRAME),
    ("fk", {"tool": "table"}, V.BAD_ARGUMENT),
    ("fk", {"link": "nothing"}, V.UNKNOWN_FRAME),
    ("jacobian", {"joints": [0.0] * 7}, V.WRONG_JOINT_COUNT),
    ("jacobian", {"frame": "table"}, V.BAD_ARGUMENT),
    ("ik", {"pose": {"position": [0.0, 0.0, 0.5]}, "seed": [0.0] * 5}, V.WRONG_JOINT_COUNT),
    ("ik", {"pose": {"position": [9.0, 0.0, 0.5]}, "frame": "nowhere"}, V.UNKNOWN_FRAME),
    ("ik", {"pose": {"position": [0.3, 0.0, 0.5], "orientation": [0, 0, 0, 1.01]}}, V.BAD_ARGUMENT),
    ("ik", {"pose": {"position": [0.3, 0.0, 0.5]}, "branches": "some"}, V.BAD_ARGUMENT),
]


@pytest.mark.parametrize(("op", "fields", "code"), REFUSED)
def test_a_question_that_has_no_answer_is_refused_by_its_code(
    asked: AskedCell, op: str, fields: dict[str, Any], code: V
) -> None:
    assert asked.ask(op, **fields)["code"] == code


def test_a_quaternion_of_three_decimals_is_taken(asked: AskedCell) -> None:
    pose = {"position": [-0.4, -0.2, 0.4], "orientation": [0.0, 1.0009, 0.0, 0.0]}
    assert "solutions" in asked.ask("ik", pose=pose, tool="flange")


@pytest.mark.parametrize("branches", ["nearest", "all", "turns"])
def test_a_pose_out_of_reach_is_refused_with_how_far_it_is(asked: AskedCell, branches: str) -> None:
    told = asked.ask("ik", pose={"position": [3.0, 0.0, 0.3]}, branches=branches, tool="flange")
    assert told["code"] == V.UNREACHABLE
    assert 2.0 < told["value"] < 2.6


def test_a_pose_that_is_out_of_reach_by_its_turn_alone_is_0_m_away() -> None:
    palletiser = AskedCell("fanuc_m410ib")
    home = serial_robot("fanuc_m410ib").home_position
    place = palletiser.ask("fk", joints=home)["position"]
    tilted = Pose.from_rpy((0.0, 0.0, 0.0), (math.pi - 0.5, 0.0, 0.0)).quaternion.tolist()
    told = palletiser.ask("ik", pose={"position": place, "orientation": tilted}, seed=home)
    assert (told["code"], told["value"]) == (V.UNREACHABLE, pytest.approx(0.0, abs=1e-4))


def test_a_question_about_a_robot_that_is_not_reported_is_refused() -> None:
    cell = AskedCell()
    cell.cell.wait(2_000)
    cell.cell.now += 10_000 * 1_000_000  # no report came meanwhile
    assert cell.pendant.ask("kinematics.fk")["code"] == V.FEEDBACK_STALE
    assert "position" in cell.pendant.ask("kinematics.fk", joints=BENT)


def test_questions_are_answered_while_the_robot_moves_and_move_nothing() -> None:
    cell = AskedCell()
    owner = cell.cell.holder()
    assert owner.move(*BENT, speed=0.1) is V.ACCEPTED
    cell.cell.wait(300)
    assert cell.cell.core.cell.under_way()
    assert "position" in cell.pendant.ask("kinematics.fk")
    assert "jacobian" in cell.pendant.ask("kinematics.jacobian")
    assert cell.cell.core.cell.under_way()
    assert cell.cell.core.cell.authority.holder is not None


WEIGHTS = [("nearest", "ur5", 5), ("all", "ur5", 2), ("turns", "ur5", 2), ("all", "kuka_iiwa14", 1)]


@pytest.mark.parametrize(("branches", "robot", "at_once"), WEIGHTS)
def test_promise_40_over_the_bound_a_question_is_refused_in_the_same_turn(
    branches: str, robot: str, at_once: int
) -> None:
    cell = AskedCell(robot)
    home = serial_robot(robot).home_position
    body = {"pose": pose_at(cell, home), "seed": home, "branches": branches}
    cell.cell.wait(1_000)
    codes = [cell.pendant.ask("kinematics.ik", **body).get("code") for _ in range(at_once + 1)]
    assert codes == [None] * at_once + [V.TOO_OFTEN]


def asks(cell: AskedCell, **fields: Any) -> list[KinematicsQuestion]:
    """Ask for a pose and let nobody answer; return the questions that are asked of a process."""
    body = json.dumps({"op": "kinematics.fk", "joints": BENT, **fields}).encode()
    asked = Received(cell.pendant.session, Management(1, body))
    out = cell.cell.core.handle(asked, cell.cell.now)
    found = (each.question for each in out if isinstance(each, Ask))
    return [each for each in found if isinstance(each, KinematicsQuestion)]


def test_promise_40_none_is_answered_on_the_loop_and_a_refused_one_asks_nobody() -> None:
    cell = AskedCell()
    cell.cell.wait(1_000)
    assert [len(asks(cell)) for _ in range(6)] == [1, 1, 1, 1, 1, 0]


def test_a_question_takes_along_only_what_it_names() -> None:
    cell = AskedCell()
    cell.cell.wait(1_000)
    (plain,), (named,), (tooled,) = asks(cell), asks(cell, frame="flange"), asks(cell, tool="tool")
    assert (plain.frames, plain.scene) == (None, None)
    assert named.frames is not None
    assert tooled.frames is not None


def test_what_a_connection_that_ended_asked_is_withdrawn() -> None:
    cell = AskedCell()
    cell.cell.wait(1_000)
    (first,), (second,) = asks(cell), asks(cell)
    out = cell.cell.core.handle(Closed(cell.pendant.session), cell.cell.now)
    withdrawn = [each.id for each in out if isinstance(each, Cancel)]
    assert withdrawn == [first.job_id, second.job_id]


@pytest.mark.parametrize("code", [V.SUPERSEDED, V.PLANNER_FAILED])
def test_what_the_process_refuses_is_told_by_its_code(code: V) -> None:
    cell = AskedCell()
    cell.cell.wait(1_000)
    (job,) = asks(cell)
    cell.cell.planned(job, PlanAnswer(job.job_id, Refusal(code), 0.0))
    assert cell.pendant.answers()[-1]["code"] == code
