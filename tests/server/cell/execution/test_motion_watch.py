"""What of a report ends a motion, with which code and which numbers (promise 52)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest
from rigs.cells.expectations import expect, known, only, refusal_from
from rigs.cells.robot_cell_situations import codes, enabled, moving
from rigs.cells.server_rig import MS, ServerRig
from rigs.motion.jog_pad import JogPad

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.motion_watch import MotionWatch, ReportTiming
from openpendant.server.cell.execution.setpoint_sources import StoredRows
from openpendant.server.cell.execution.tracking import TrackingTolerances, tracking_tolerances
from openpendant.server.events.effects import SendStop, SendToController
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import CellSettings, ControllerLink, settings_as_data
from openpendant.simplemsg import JointTrajPtFull
from openpendant.simplemsg.pendant import Activity, StopChanged, StopKind
from openpendant.simplemsg.verdicts import VerdictCode as V

LIMITS = JointLimits(
    names=("turning", "sliding"),
    lower=(-2.0, 0.0),
    upper=(2.0, 1.0),
    velocity=(2.0, 0.5),
    acceleration=(4.0, 4.0),
    prismatic=(False, True),
)
CLOSE = TrackingTolerances((0.01, 0.005), 0.01, 0.0, (0.02, 0.01))
NOISY = TrackingTolerances((0.5, 0.5), 0.1, 0.001, (0.02, 0.01))
WIDE = TrackingTolerances((9.0, 9.0), 0.0, 0.0, (9.0, 9.0))


class TwoLinks:
    """A tool 2 m from the turning joint, and an elbow that only slides."""

    lever_arms: Sequence[Sequence[float]] = ((2.0, 1.0), (0.0, 1.0))

    def speed_points(self, position: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        turned, slid = position
        return (2.0 * turned, slid, 0.0), (0.0, slid, 0.0)


@dataclass
class Watched:
    tolerances: TrackingTolerances = CLOSE
    start: tuple[float, float] = (0.0, 0.5)
    cap: float | None = None
    speeds: tuple[float, float] = (0.0, 0.0)
    now: int = 0
    points: TwoLinks = field(default_factory=TwoLinks)
    refused: list[Refusal] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.timing = ReportTiming(0.01)
        self.report(*self.start)
        self.timing.begin()
        self.watch = MotionWatch(
            LIMITS, self.tolerances, self.timing, self.start, self.points, lambda: self.cap
        )
        for index in range(200):
            place = [a + b * index / 100 for a, b in zip(self.start, self.speeds, strict=True)]
            self.watch.commanded(index * 10 * MS, Row(index / 100, place, list(self.speeds), []))

    def report(self, *position: float) -> Refusal | None:
        report = self.timing.take(position, self.now)
        self.now += 10 * MS
        return self.watch.judge(report) if hasattr(self, "watch") else None

    def along(
        self, place: Callable[[float], tuple[float, float]], seconds: float
    ) -> Refusal | None:
        for _ in range(round(seconds * 100)):
            refusal = self.report(*place(self.now / 1e9))
            if refusal is not None:
                return refusal
        return None


def code_of(refusal: Refusal | None) -> V | None:
    return None if refusal is None else refusal.code


def test_one_that_stands_where_it_was_commanded_goes_on() -> None:
    assert Watched().along(lambda _: (0.0, 0.5), 1.5) is None


@pytest.mark.parametrize(
    ("to", "code", "joint", "limit"),
    [
        ((0.3, 0.5), V.LEFT_THE_PATH, 0, 0.01),
        ((0.0, 0.506), V.LEFT_THE_PATH, 1, 0.005),
        ((2.03, 0.5), V.OVER_RANGE, 0, 2.02),
        ((-2.03, 0.5), V.OVER_RANGE, 0, -2.02),
        ((0.0, 1.011), V.OVER_RANGE, 1, 1.01),
    ],
)
def test_a_jump_is_called_by_what_it_breaks(
    to: tuple[float, float], code: V, joint: int, limit: float
) -> None:
    it = Watched()
    assert it.along(lambda _: (0.0, 0.5), 0.3) is None
    refusal = refusal_from(it.report(*to))
    assert (refusal.code, refusal.joint) == (code, joint)
    assert refusal.limit == pytest.approx(limit)
    reported = abs(to[joint] - (0.0, 0.5)[joint]) if code is V.LEFT_THE_PATH else to[joint]
    assert refusal.value == pytest.approx(reported)


def test_the_refusal_says_the_tolerances_that_it_comes_from() -> None:
    it = Watched()
    assert refusal_from(it.report(0.3, 0.5)).text == (
        "joint 1 is reported 0.3000 rad off its path, accepted 0.0100: path_tolerance 0.01 rad,"
        " lag 0.01 s at 0.000 rad/s, noise 0 rad"
    )


def test_who_begins_outside_may_be_there_and_no_farther() -> None:
    it = Watched(WIDE._replace(range=(0.02, 0.01)), start=(2.1, 0.5))
    assert it.along(lambda _: (2.119, 0.5), 0.3) is None
    refusal = refusal_from(it.report(2.121, 0.5))
    assert refusal.code is V.OVER_RANGE
    assert refusal.limit == pytest.approx(2.12)


@pytest.mark.parametrize(("speed", "code"), [(2.19, None), (2.21, V.OVER_SPEED)])
def test_a_joint_may_be_a_tenth_faster_than_its_limit(speed: float, code: V | None) -> None:
    refusal = Watched(WIDE, start=(-1.0, 0.5)).along(lambda t: (-1.0 + speed * t, 0.5), 0.5)
    assert code_of(refusal) is code
    if refusal is not None:
        assert (refusal.value, refusal.limit) == pytest.approx((speed, 2.2))
        assert refusal.joint == 0


def test_noise_is_accepted_twice_in_the_time_of_a_speed() -> None:
    it = Watched(WIDE._replace(noise=0.001))
    # 2 rad/s and a tenth, and 2 mrad in 50 ms.
    assert it.along(lambda t: (2.239 * t, 0.5), 0.3) is None
    it = Watched(WIDE._replace(noise=0.001))
    fast = refusal_from(it.along(lambda t: (2.241 * t, 0.5), 0.3))
    assert fast.limit == pytest.approx(2.24)


@pytest.mark.parametrize(
    ("cap", "turn", "slide", "code"),
    [
        (0.25, 0.137, 0.0, None),  # the tool at 0.274 m/s
        (0.25, 0.138, 0.0, V.OVER_SPEED),
        (0.25, 0.0, 0.274, None),
        (0.25, 0.0, 0.276, V.OVER_SPEED),  # the elbow, and the tool with it
        (None, 0.138, 0.276, None),  # automatic
    ],
)
def test_tool_and_elbow_keep_to_the_cap_of_the_mode(
    cap: float | None, turn: float, slide: float, code: V | None
) -> None:
    it = Watched(WIDE, cap=cap, start=(0.0, 0.0))
    refusal = it.along(lambda t: (turn * t, slide * t), 0.6)
    assert code_of(refusal) is code
    if refusal is not None:
        assert refusal.joint == -1
        assert refusal.limit == pytest.approx(0.275)
        # Over a quarter of a second, and not before there is one.
        assert it.now - 10 * MS == 250 * MS


def test_what_lags_add_to_the_speed_of_the_tool_is_accepted() -> None:
    """Two joints whose ways cancel out at the tool, one of them 0.1 s behind."""
    tolerances = NOISY._replace(noise=0.0)
    it = Watched(tolerances, cap=0.25, start=(0.0, 0.9), speeds=(0.15, -0.3))
    # Within 250 ms 62.5 mm and a tenth, and 0.1 s of both joints' speeds by their levers: 60 mm.
    assert it.along(lambda t: (0.25 * t, 0.9), 0.4) is None
    it = Watched(tolerances, cap=0.25, start=(0.0, 0.9), speeds=(0.15, -0.3))
    assert it.along(lambda t: (0.26 * t, 0.9), 0.4) is not None


@pytest.mark.parametrize(("turn", "code"), [(0.149, None), (0.150, V.OVER_SPEED)])
def test_noise_counts_twice_for_the_tool_by_the_levers_of_all_joints(
    turn: float, code: V | None
) -> None:
    # In 250 ms 62.5 mm and a tenth, and 2 mrad or mm times 2 m and 1.
    it = Watched(WIDE._replace(noise=0.001), cap=0.25, start=(0.0, 0.0))
    assert code_of(it.along(lambda t: (turn * t, 0.0), 0.4)) is code


class ElbowOnly(TwoLinks):
    def speed_points(self, position: Sequence[float]) -> tuple[tuple[float, ...], ...]:
        return (0.0, 0.0, 0.0), (0.0, position[1], 0.0)


def test_an_elbow_that_is_too_fast_is_named_though_the_tool_stands() -> None:
    it = Watched(WIDE, cap=0.25, start=(0.0, 0.0), points=ElbowOnly())
    refusal = refusal_from(it.along(lambda t: (0.0, 0.28 * t), 0.4))
    assert (refusal.code, refusal.joint) == (V.OVER_SPEED, -1)
    assert refusal.text.startswith("the elbow is reported at 0.280 m/s over 250 ms")


def test_a_cap_that_is_lowered_on_the_way_does_not_count_against_what_has_left() -> None:
    it = Watched(WIDE, cap=0.25, start=(0.0, 0.0))
    assert it.along(lambda t: (0.0, 0.24 * t), 0.4) is None
    it.cap = 0.1
    assert it.along(lambda t: (0.0, 0.24 * t), 0.4) is None


def test_during_a_stop_it_may_leave_its_path_and_nothing_else() -> None:
    it = Watched(start=(1.5, 0.5), speeds=(0.5, 0.0))
    assert it.along(lambda t: (1.5 + 0.5 * t, 0.5), 0.4) is None
    it.watch.stopping()
    assert it.along(lambda t: (1.5 + 0.5 * t, 0.5 + 0.3 * (t - 0.4)), 0.5) is None
    assert refusal_from(it.along(lambda t: (1.5 + 0.5 * t, 0.65), 0.5)).code is V.OVER_RANGE


def test_during_a_stop_a_run_away_is_too_fast() -> None:
    it = Watched(start=(-1.0, 0.5), speeds=(0.5, 0.0))
    assert it.along(lambda t: (-1.0 + 0.5 * t, 0.5), 0.4) is None
    it.watch.stopping()
    assert refusal_from(it.along(lambda t: (-0.8 + 3.0 * (t - 0.4), 0.5), 0.5)).code is V.OVER_SPEED


@pytest.mark.parametrize(("turn", "code"), [(0.32, None), (0.34, V.OVER_SPEED)])
def test_during_a_stop_a_tool_may_be_as_fast_as_the_joints_last_speeds_can_make_it(
    turn: float, code: V | None
) -> None:
    """The slide that made up for the turn brakes sooner: 2 m times 0.15 rad/s, and 0.3 m/s."""
    it = Watched(WIDE, cap=0.25, start=(0.0, 0.9), speeds=(0.15, -0.3))
    it.watch.stopping()
    assert code_of(it.along(lambda t: (turn * t, 0.9), 0.4)) is code


@pytest.mark.parametrize(
    ("given", "emulated", "expected"),
    [
        ({}, False, ((0.02, 0.01), 0.08, 0.001)),
        ({}, True, ((0.01, 0.005), 0.01, 0.0)),
        ({"path_tolerance": 0.02}, True, ((0.02, 0.01), 0.01, 0.0)),
        ({"lag": 0.08, "noise": 0.001}, True, ((0.01, 0.005), 0.08, 0.001)),
        ({"path_tolerance": 0.1, "lag": 0.2, "noise": 0.0}, False, ((0.1, 0.05), 0.2, 0.0)),
    ],
)
def test_what_a_file_names_counts_and_the_rest_is_closer_on_an_emulated_controller(
    given: dict[str, float], emulated: bool, expected: tuple[tuple[float, ...], float, float]
) -> None:
    link = ControllerLink.model_validate(given)
    found = tracking_tolerances(link, LIMITS, says_emulated=emulated)
    assert (found.path, found.lag, found.noise) == expected
    assert found.range == (0.02, 0.01)
    # A journal is run again by the settings in its header: a jog, say, by the same lag.
    noted = settings_as_data(CellSettings(controller=link))
    again = CellSettings.model_validate(noted)
    assert again == CellSettings(controller=link)
    assert tracking_tolerances(again.controller, LIMITS, says_emulated=emulated) == found


def cruising() -> tuple[ServerRig, JogPad]:
    """Return a motion that was planned under a cap of 2 m/s and runs at full speed."""
    rig, pad = enabled("manual_high", controller={"lead": 0.09})
    assert pad.speed(1.0, 2.0) is V.ACCEPTED
    assert pad.pendant.path((0.0, 0.5), (1.9, 1.9)) is V.ACCEPTED
    pad.hold(400)
    assert newest_speed(rig) == pytest.approx(2.0, rel=0.05)
    return rig, pad


def newest_speed(rig: ServerRig) -> float:
    point = expect(JointTrajPtFull, rig.points[-1])
    return max(abs(velocity) for velocity in point.velocities)


def test_a_lower_cap_slows_the_motion_in_proportion_and_a_higher_one_does_not_speed_it_up() -> None:
    rig, pad = cruising()
    assert pad.speed(1.0, 1.0) is V.ACCEPTED
    pad.hold(280)
    assert newest_speed(rig) == pytest.approx(1.0, rel=0.05)
    assert pad.speed(1.0, 4.0) is V.ACCEPTED
    pad.hold(100)
    assert 1.0 < newest_speed(rig) <= 2.0 * (1 + 1e-9)
    assert rig.activity() is Activity.MOVING


def test_a_fault_of_the_controller_that_is_gone_before_the_next_tick_ends_the_motion() -> None:
    rig, pad = cruising()
    rig.controller.e_stopped = True
    rig.report()
    assert len(rig.stops) == 1
    rig.controller.e_stopped = False
    rig.report()
    pad.hold(50)
    assert pad.pendant.outcomes()[-1][1] is V.CONTROLLER_STOPPED


@pytest.mark.parametrize(
    "fault",
    [{"position": [9.0, 0.0]}, {"velocity": [9.0, 0.0]}, {"position": [float("nan"), 0.0]}],
    ids=["position", "velocity", "no number"],
)
def test_a_sample_that_became_faulty_does_not_leave(
    fault: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, pendant = moving()
    take, sent = StoredRows.take, len(rig.points)

    monkeypatch.setattr(StoredRows, "take", lambda rows: take(rows)._replace(**fault))
    rig.now += 10 * MS
    rig.report()
    out = rig.tick()
    assert isinstance(out[0], SendStop)
    assert not any(isinstance(item, SendToController) for item in out)
    assert only(StopChanged, pendant.all(StopChanged)).stop == StopKind.PROTECTIVE
    assert known(rig.core.cell.stop).is_protective
    assert codes(pendant) == [V.CERTIFICATE_REFUSED]
    monkeypatch.undo()
    rig.wait(500)
    assert len(rig.points) == sent
