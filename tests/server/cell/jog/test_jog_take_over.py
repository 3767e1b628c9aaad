from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import ServerRig, ready
from rigs.motion.jog_pad import EmulatedPad, JogPad

from openpendant.simplemsg.pendant import Activity, JogEnd, JogEnded, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode as V

BALL = {"name": "ball", "shape": {"type": "sphere", "radius": 0.05}, "position": [0.0, 0.0, 3.0]}


def jogging() -> tuple[ServerRig, JogPad]:
    rig = ready(modes={"initial": "manual_high"})
    pad = JogPad(rig)
    pad.squeeze()
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    return rig, pad


# What is told of the press that was taken over.


def hold_on(pad: JogPad) -> None:
    """Leave the press as it is."""


def release(pad: JogPad) -> None:
    assert pad.release() is V.ACCEPTED
    pad.hold(40)


def fall_silent(pad: JogPad) -> None:
    pad.is_pressed = False
    pad.hold(190)


def set_the_override_to_0(pad: JogPad) -> None:
    assert pad.speed(0.0) is V.ACCEPTED
    pad.hold(40)
    assert pad.speed(1.0) is V.ACCEPTED


@pytest.mark.parametrize(
    ("end", "reason"),
    [
        (hold_on, JogEnd.REPLACED),
        (release, JogEnd.RELEASED),
        (fall_silent, JogEnd.SILENT),
        (set_the_override_to_0, JogEnd.STOPPED),
    ],
)
def test_a_press_that_was_taken_over_is_told_as_it_ended(
    end: Callable[[JogPad], None], reason: JogEnd
) -> None:
    rig, pad = jogging()
    end(pad)
    assert rig.activity() is Activity.JOGGING
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    (ended,) = pad.pendant.all(JogEnded)
    assert (ended.press, ended.reason) == (1, reason)
    braked = reason is not JogEnd.REPLACED
    assert (ended.stop_time > 0.0, ended.joint_distance > 0.0) == (braked, braked)


# Where scene, frames or tools are others than those that the jog began with.


def repeat(pad: EmulatedPad, milliseconds: int) -> list[V | None]:
    """Press every 30 ms, as a key that is held in a terminal does."""
    codes = []
    for _ in range(0, milliseconds, 30):
        codes.append(pad.press(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        pad.hold(30)
    return codes


def add_to_the_scene(pad: EmulatedPad) -> None:
    pad.ask("scene.add", object=BALL, expected_revision=0)


def swap_tools(pad: EmulatedPad) -> None:
    view = pad.cell.core.environment
    assert view is not None
    view.world._view.apply_scene(view.world.frames, view.world.scene)


@pytest.mark.parametrize("change", [add_to_the_scene, swap_tools])
def test_a_key_that_repeats_does_not_jog_on_in_the_surroundings_of_before(
    change: Callable[[EmulatedPad], None],
) -> None:
    pad = EmulatedPad(EmulatedCell(has_surroundings=True), OperatingMode.MANUAL_HIGH)
    assert repeat(pad, 300) == [V.ACCEPTED] * 10
    began = pad.cell.core.cell.driving.driven_jog
    change(pad)
    codes = repeat(pad, 900)
    assert codes[0] is V.MOVING
    rested = codes.index(V.ACCEPTED)
    assert set(codes[:rested]) == {V.MOVING}
    assert set(codes[rested:]) == {V.ACCEPTED}
    driven = pad.cell.core.cell.driving.driven_jog
    assert driven is not None
    assert driven is not began
