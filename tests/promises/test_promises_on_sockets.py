"""Promises 1, 2, 18 to 21, 26, and the press that begins a motion, measured where bytes arrive.

A recording controller stands between server and emulated robot; each trial is measured there, and
beside each an event loop that has nothing to do. Bounds and trials are those of the table.
"""

import os
import random
import signal
import struct
import subprocess
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from enum import Enum
from itertools import pairwise
from pathlib import Path

import pytest
from promises.promise_figures import SLACK, Figures, Void, tell, trials_of
from promises.promise_table import COMMON, Figure, figure
from rigs.clock.busy_machine import SCALE
from rigs.peers.wire_pendant import WirePendant
from rigs.processes.promise_rig import Arrival, PromiseRig, promise_rig

from openpendant.simplemsg import CommType, Message, joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(3_600)]

LISTENERS = figure(19, "listeners").count
LISTENER_RATE = 25.0

RAMP, STOPPED = figure(1, "late"), figure(2, "stop")
PRESSED, REFUSED = figure(COMMON, "press"), figure(18, "refused")
OBSERVED_STOP = figure(19, "stop")
LET_GO = figure(37, "late")

OWN_FRAMES = figure(19, "own").count
OWN_TRIALS = [
    pytest.param(8, SLACK, id="few"),
    pytest.param(figure(19, "own").trials, 1.0, id="many", marks=pytest.mark.soak),
]

BY_DEADLINE = 75.0
"""The deadline that a press declares [ms]."""

SLOW = 0.2
"""Part of the jog speed that keys move the robot with; from there it is soon at rest."""

STORMED = figure(20, "late")
SHORTEST_STORM = 0.8
"""A storm lasts so long at least [s], else as long as the ticks that are wanted."""

MOST_ENDED_EARLY = 2
"""So many storms may end a jog on a machine that was late."""

MACHINE_LATE = 25.0 * SCALE
"""A machine that delays others so long can end a jog: half of what points are sent ahead [ms]."""


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PromiseRig]:
    """All tests share this one but those of the rate at which it takes connections."""
    with promise_rig(tmp_path_factory.mktemp("promises"), is_open=True) as made:
        yield made


def is_stop(arrival: Arrival) -> bool:
    return arrival.is_stop


def moves(arrival: Arrival) -> bool:
    return bool(arrival.joint_velocity)


def first_slower(rig: PromiseRig, since: int) -> Arrival | None:
    """Return the first set-point after a time [ns] that is slower than the last, or a stop."""
    arrivals = rig.controller.arrivals
    at = len(arrivals)
    while at and arrivals[at - 1].time > since:
        at -= 1
    points = [each for each in arrivals[max(at - 20, 0) :] if each.msg_type]
    for before, point in pairwise(points):
        slower = abs(point.joint_velocity or 0.0) < abs(before.joint_velocity or 0.0) - 1e-6
        if point.time > since and (slower or point.is_stop):
            return point
    return None


def moved_by(rig: PromiseRig, pendant: WirePendant, pressed: int) -> Arrival | None:
    """Hold a key that was pressed [ns] until it moves the robot, or for a tenth of a second."""
    moved = None
    while moved is None and time.monotonic_ns() < pressed + 100_000_000:
        pendant.listen(0.005)
        moved = rig.controller.first(moves, pressed, 0.0)
    return moved


def hold_key(rig: PromiseRig, pendant: WirePendant, chance: random.Random, trial: int) -> None:
    """Hold a key, once this way and once that, until the robot has moved for up to three ticks.

    A machine that is busy may make the server refuse a press, or the watchdog stop the robot before
    the trial begins; then the key is pressed again.
    """
    for _ in range(20):
        pressed = pendant.press(SLOW if trial % 2 else -SLOW, BY_DEADLINE / 1e3)
        if moved_by(rig, pendant, pressed) is not None:
            pendant.listen(chance.random() * 0.03)
            return
        pendant.listen(0.2)
        pendant.come_to_rest()
        if pendant.state is not None and pendant.state.stop != messages.StopKind.NONE:
            pendant.reset()
        else:
            pendant.hold_anew()
    raise AssertionError(f"the robot does not move: {pendant.got[-4:]}")


def no_motion(rig: PromiseRig, since: int) -> None:
    """Fail where the robot was moved after a time [ns]: then the trial was not void."""
    late = [each for each in rig.controller.arrivals if each.time > since and moves(each)]
    assert not late, "set-points, and nothing that ended them"


class End(Enum):
    FIN = "fin"
    RESET = "reset"
    KILL = "kill"


def lose(rig: PromiseRig, end: End, chance: random.Random, trial: int) -> int:
    """Let a new pendant jog and end its connection; return when [ns].

    Killed is a process that alone holds the socket; it is there before the key is pressed, because
    to start it may take longer than a press lives.
    """
    pendant = rig.pendant(f"hand {trial}")
    pendant.take_control()
    with ExitStack() as stack:
        command = ["sleep", "60"]
        holder = None
        if end is End.KILL:
            shared = [pendant.sock.fileno()]
            holder = stack.enter_context(subprocess.Popen(command, pass_fds=shared))
        hold_key(rig, pendant, chance, trial)
        if holder is not None:
            pendant.close()
        now = time.monotonic_ns()
        match end:
            case End.FIN:
                pendant.close()
            case End.RESET:
                pendant.abort()
            case End.KILL if holder is not None:
                holder.kill()
    return now


def test_promise_18_of_thirty_that_ask_at_once_one_gets_it_and_the_others_hear_who(
    rig: PromiseRig,
) -> None:
    crowd = [rig.pendant(f"racer {number}", rate=0.0) for number in range(30)]
    requests = [
        messages.Authority(each.request(), messages.AuthorityAction.REQUEST) for each in crowd
    ]
    for pendant, request in zip(crowd, requests, strict=True):
        pendant.send(request)
    answers: list[messages.Verdict] = []
    for pendant in crowd:
        pendant.wait_for(messages.Verdict)
        answers += [each for each in pendant.got if isinstance(each, messages.Verdict)]
    codes = Counter(V(each.code) for each in answers)
    assert codes == {V.ACCEPTED: 1, V.HELD_BY_OTHER: 29}
    (winner,) = [n for n, each in enumerate(answers) if each.code == V.ACCEPTED]
    assert all(f"racer {winner}" in each.text for each in answers if each.code)
    for pendant in crowd:
        pendant.close()


@pytest.mark.parametrize(("trials", "slack"), trials_of(OBSERVED_STOP))
def test_promise_19_a_stop_passes_200_listeners_and_a_planning_job_within_20_ms(
    rig: PromiseRig, trials: int, slack: float
) -> None:
    chance = random.Random(19)
    figures = Figures("promise 19, stop in to stop out")
    with rig.beside(("listeners", LISTENERS, LISTENER_RATE), ("planner",)):
        observer = rig.pendant("observer", rate=0.0)
        pendant = rig.pendant("mover")
        pendant.take_control()
        while figures.need_more(trials, OBSERVED_STOP.ms, slack):
            hold_key(rig, pendant, chance, len(figures.delays))
            asked = observer.stop()
            stop = rig.controller.first(is_stop, asked)
            assert stop is not None
            figures.take(asked, (stop.time - asked) / 1e6)
            figures.idle.append(rig.idle_delay())
            pendant.wait_until(lambda state: state.stop != messages.StopKind.NONE)
            pendant.come_to_rest()
            observer.listen(0.001)
            assert pendant.reset() is V.ACCEPTED
            pendant.wait_until(lambda state: state.stop == messages.StopKind.NONE)
        pendant.close()
        observer.close()
    figures.judge(OBSERVED_STOP.ms, slack=slack, most=figure(19, "most").ms)


@pytest.mark.soak
def test_promise_21_a_jog_goes_on_beside_a_thousand_idle_connections(tmp_path: Path) -> None:
    figures, late = Figures("promise 21, ticks late beside 1,000"), figure(21, "late")
    most = {"max_connections": figure(21, "most").count}
    crowd = ("listeners", figure(21, "crowd").count, 0.0)
    with promise_rig(tmp_path, listen=most) as rig, rig.beside(crowd):
        pendant = rig.pendant("one more")
        pendant.take_control()
        while figures.need_more(late.trials, late.ms):
            pendant.hold_anew()
            pendant.press(0.3 if len(figures.delays) % 200 < 100 else -0.3)
            rig.watch_ticks(pendant, 1.0, figures)
            assert is_jogging(pendant)
            pendant.come_to_rest()
    figures.judge(late.ms)


@pytest.mark.parametrize(("trials", "slack"), trials_of(STOPPED))
@pytest.mark.parametrize("end", End)
def test_promise_2_a_lost_connection_stops_within_20_ms(
    rig: PromiseRig, end: End, trials: int, slack: float
) -> None:
    chance = random.Random(2)
    figures = Figures(f"promise 2, {end.value}")
    void = Void(figures, trials)
    while figures.need_more(trials, STOPPED.ms, slack):
        ended = lose(rig, end, chance, len(figures.delays) + void.count)
        stop = rig.controller.first(is_stop, ended, 1.0)
        if stop is None:
            no_motion(rig, ended)
            void.add()
            continue
        figures.take(ended, (stop.time - ended) / 1e6)
        figures.idle.append(rig.idle_delay())
    figures.judge(STOPPED.ms, slack=slack)


HELD_TICKS = {"released": 3, "pressed through": 0, "released with the key": 1}
"""So many ticks after a sign of an enabling device a STOP leaves, or the ramp of both hands."""


@pytest.mark.parametrize(("trials", "slack"), trials_of(LET_GO))
@pytest.mark.parametrize("how", HELD_TICKS)
def test_promise_37_what_a_device_ends_arrives_within_its_ticks_and_20_ms(
    rig: PromiseRig, how: str, trials: int, slack: float
) -> None:
    chance = random.Random(37)
    figures = Figures(f"promise 37, {how}")
    void = Void(figures, trials)
    pendant = rig.pendant("two hands")
    pendant.take_control()
    is_panic, with_key = how == "pressed through", how == "released with the key"
    position = messages.EnablingPosition.PANIC if is_panic else messages.EnablingPosition.RELEASED
    while figures.need_more(trials, LET_GO.ms, slack):
        hold_key(rig, pendant, chance, len(figures.delays))
        let_go = pendant.let_go(position, key=with_key)
        ended = None
        while ended is None and time.monotonic_ns() < let_go + 1_000_000_000:
            pendant.listen(0.01)
            stopped = rig.controller.first(is_stop, let_go, 0.0)
            ended = first_slower(rig, let_go) if with_key else stopped
        pendant.come_to_rest()
        pendant.hold_anew()
        if ended is None:
            no_motion(rig, let_go)
            void.add()
            continue
        assert with_key == (rig.controller.first(is_stop, let_go, 0.0) is None)
        figures.take(let_go, (ended.time - let_go) / 1e6 - 10.0 * HELD_TICKS[how])
        figures.idle.append(rig.idle_delay())
    pendant.close()
    figures.judge(LET_GO.ms, slack=slack)


@pytest.mark.parametrize(("trials", "slack"), trials_of(RAMP))
def test_promise_1_a_silent_press_ramps_down_by_its_deadline_and_two_ticks(
    rig: PromiseRig, trials: int, slack: float
) -> None:
    """The bound is deadline and one tick on the server's clock; sockets get one more tick."""
    chance = random.Random(1)
    figures = Figures("promise 1, after the deadline")
    void = Void(figures, trials)
    pendant = rig.pendant("silent")
    pendant.take_control()
    while figures.need_more(trials, RAMP.ms, slack):
        hold_key(rig, pendant, chance, len(figures.delays))
        last_beat = pendant.beat()
        pendant.beats = False
        ramp = None
        while ramp is None and time.monotonic_ns() < last_beat + 1_250_000_000:
            pendant.listen(0.01)
            ramp = first_slower(rig, last_beat)
        pendant.come_to_rest()
        if ramp is None:
            no_motion(rig, last_beat)
            void.add()
            continue
        figures.take(last_beat, (ramp.time - last_beat) / 1e6 - BY_DEADLINE)
        figures.idle.append(rig.idle_delay())
    pendant.close()
    figures.judge(RAMP.ms, slack=slack)


@pytest.mark.parametrize(("trials", "slack"), trials_of(PRESSED))
def test_a_press_changes_the_set_point_within_30_ms(
    rig: PromiseRig, trials: int, slack: float
) -> None:
    chance = random.Random(30)
    figures = Figures("press to first changed set-point")
    void = Void(figures, trials)
    pendant = rig.pendant("presser")
    pendant.take_control()
    while figures.need_more(trials, PRESSED.ms, slack):
        pendant.listen(chance.random() * 0.02)
        before = len(pendant.got)
        pressed = pendant.press(SLOW if len(figures.delays) % 2 else -SLOW)
        moved = moved_by(rig, pendant, pressed) or rig.controller.first(moves, pressed, 1.0)
        if moved is None:
            pendant.listen(0.05)
            refused = [each for each in pendant.got[before:] if isinstance(each, messages.Verdict)]
            assert refused, "a press that was neither obeyed nor refused"
            assert refused[0].code != V.ACCEPTED, refused
            void.add()
            pendant.come_to_rest()
            pendant.hold_anew()
            continue
        figures.take(pressed, (moved.time - pressed) / 1e6)
        figures.idle.append(rig.idle_delay())
        pendant.come_to_rest()
    pendant.close()
    figures.judge(PRESSED.ms, slack=slack)


def frame_of_its_own(pendant: WirePendant, number: int) -> Message:
    match number % 3:
        case 0:
            return messages.Management(
                pendant.request(), b'{"op": "why", "key": "a question of 88 bytes"}'
            )
        case 1:
            return messages.JointMove(pendant.request(), 0.1, 6, joint_array((0.1,) * 6))
    return messages.AuthorityBeat()


@pytest.mark.parametrize(("trials", "slack"), OWN_TRIALS)
def test_promise_19_a_stop_passes_5000_frames_of_its_own_within_20_ms(
    rig: PromiseRig, trials: int, slack: float
) -> None:
    """From the first byte of the stop, all others being in the kernel, to the stop that leaves."""
    for count in (0, 100, 1_000, OWN_FRAMES):
        figures = Figures(f"promise 19, stop behind {count:,} frames of its own")
        while figures.need_more(trials // 4, OBSERVED_STOP.ms, slack):
            pendant = rig.pendant("behind", rate=0.0)
            pendant.wait_for(messages.HelloReply)
            frames = [pendant.frame(frame_of_its_own(pendant, at)) for at in range(count)]
            assert all(len(frame) <= 88 for frame in frames)
            pendant.sock.sendall(b"".join(frames))
            asked = pendant.stop()
            stop = rig.controller.first(is_stop, asked)
            assert stop is not None
            figures.take(asked, (stop.time - asked) / 1e6)
            figures.idle.append(rig.idle_delay())
            pendant.close()
        figures.judge(OBSERVED_STOP.ms, slack=slack, most=figure(19, "most").ms)


@pytest.mark.parametrize(("trials", "slack"), OWN_TRIALS)
def test_promise_19_no_stop_is_lost_where_its_connection_is_cut(
    rig: PromiseRig, trials: int, slack: float
) -> None:
    """Cut by the server, for what stands in front or behind; by a reset; by an end."""
    for trial in range(trials):
        pendant = rig.pendant("cut", rate=0.0)
        pendant.wait_for(messages.HelloReply)
        if trial % 2:
            # States that the server writes to a connection that was reset meanwhile.
            pendant.send(messages.Subscribe(pendant.request(), 125.0))
        asked = time.monotonic_ns()
        stop = pendant.frame(messages.SoftwareStop(pendant.request(), "not lost"))
        match trial % 5:
            case 0:
                unknown = struct.pack("<4i", 12, 64_000, CommType.REQUEST, 0)
                pendant.sock.sendall(unknown * 10 + stop)
            case 1:
                pendant.sock.sendall(stop + bytes(4))
            case 2 | 3:
                pendant.sock.sendall(pendant.frame(messages.AuthorityBeat()) * (trial % 50) + stop)
                pendant.abort()
            case _:
                pendant.sock.sendall(pendant.frame(messages.AuthorityBeat()) * (trial % 50) + stop)
        pendant.close()
        assert rig.controller.first(is_stop, asked, 1.0 * SCALE) is not None, trial


@pytest.mark.parametrize(("trials", "slack"), trials_of(REFUSED))
def test_promise_18_a_second_one_is_refused_within_20_ms(
    rig: PromiseRig, trials: int, slack: float
) -> None:
    figures = Figures("promise 18, request to refusal")
    holder, second = rig.pendant("holder"), rig.pendant("second", rate=0.0)
    holder.take_control()
    while figures.need_more(trials, REFUSED.ms, slack):
        holder.listen(0.01)
        asked = time.monotonic_ns()
        code = second.verdict(
            messages.Authority(second.request(), messages.AuthorityAction.REQUEST)
        )
        figures.take(asked, (time.monotonic_ns() - asked) / 1e6)
        figures.idle.append(rig.idle_delay())
        assert code is V.HELD_BY_OTHER
    holder.close()
    second.close()
    figures.judge(REFUSED.ms, slack=slack)


def broke_off_late(message: Message) -> bool:
    """Tell whether a jog ended because a point or a beat had not come in time.

    A controller that ran out of points refuses the next one, mostly before it has shown why.
    """
    match message:
        case messages.Outcome():
            return message.code == V.CONTROLLER_REFUSED or "under-run" in message.text
        case messages.JogEnded():
            return message.reason == messages.JogEnd.SILENT
    return False


def is_jogging(pendant: WirePendant) -> bool:
    assert pendant.state is not None
    return pendant.state.activity == messages.Activity.JOGGING


def storm_on_jog(rig: PromiseRig, pendant: WirePendant, figures: Figures, seconds: float) -> float:
    """Hold a key in a storm; return how late the machine let others be [ms]."""
    with rig.beside(("storm",)):
        pendant.hold_anew()
        pendant.press(0.3)
        return rig.watch_ticks(pendant, seconds, figures)


@pytest.mark.parametrize(("trials", "slack"), trials_of(STORMED))
def test_promise_20_a_storm_of_connections_neither_delays_ticks_nor_ends_a_jog(
    tmp_path: Path, trials: int, slack: float
) -> None:
    """Ticks count whatever became of the jog.

    A point or a beat passes three processes, and one that the machine lets come late ends a jog in
    any weather: there is another run, twice, where the machine delayed others as well meanwhile.
    """
    figures = Figures("promise 20, ticks late in a storm")
    held = ended_early = 0
    seconds = max(0.01 * trials, SHORTEST_STORM)
    with promise_rig(tmp_path) as rig:
        pendant = rig.pendant("in the storm")
        pendant.take_control()
        while figures.need_more(trials, STORMED.ms, slack) or not held:
            latest = storm_on_jog(rig, pendant, figures, seconds)
            if is_jogging(pendant):
                held += 1
            else:
                said = f"the machine was {latest:.1f} ms late at most; {pendant.got[-4:]}"
                assert any(broke_off_late(each) for each in pendant.got[-4:]), said
                assert latest > MACHINE_LATE, said
                ended_early += 1
                assert ended_early <= MOST_ENDED_EARLY, said
                tell(f"promise 20, another run: {said}")
            pendant.come_to_rest()
    figures.judge(STORMED.ms, slack=slack)


REAL, EMULATED = figure(26, "stopped"), figure(26, "emulated_stopped")
EXPLICIT = {"deadline": figure(26, "stop").seconds}


def stop_after_freeze(rig: PromiseRig) -> tuple[int, Arrival | None]:
    frozen = time.monotonic_ns()
    os.kill(rig.server_pid, signal.SIGSTOP)
    try:
        return frozen, rig.controller.first(is_stop, frozen, 2.0)
    finally:
        os.kill(rig.server_pid, signal.SIGCONT)


def come_back(pendant: WirePendant) -> None:
    pendant.beats = False
    pendant.wait_until(lambda state: state.stop != messages.StopKind.NONE)
    pendant.come_to_rest()
    assert pendant.reset() is V.ACCEPTED
    pendant.wait_until(lambda state: state.stop == messages.StopKind.NONE)


@pytest.mark.soak
@pytest.mark.parametrize(("settings", "stopped"), [(EXPLICIT, REAL), ({}, EMULATED)])
def test_promise_26_a_frozen_server_is_stopped_for_within_200_ms(
    tmp_path: Path, settings: dict[str, float], stopped: Figure
) -> None:
    figures = Figures("promise 26, server frozen to STOP at the controller")
    void = Void(figures, stopped.trials)
    with promise_rig(tmp_path, watchdog=settings) as rig:
        pendant = rig.pendant("frozen out")
        pendant.take_control()
        while figures.need_more(stopped.trials, stopped.ms):
            pendant.hold_anew()
            pressed = pendant.press(0.3 if len(figures.delays) % 2 else -0.3, 0.25)
            pendant.listen(0.08)
            if rig.controller.first(moves, pressed, 0.0) is None:
                void.add()
                pendant.come_to_rest()
                continue
            frozen, stop = stop_after_freeze(rig)
            assert stop is not None, "nobody stopped the robot"
            figures.take(frozen, (stop.time - frozen) / 1e6)
            figures.idle.append(rig.idle_delay())
            come_back(pendant)
        pendant.close()
    figures.judge(stopped.ms)
