from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import ServerRig, ready
from rigs.motion.jog_pad import JogPad
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg import ReplyCode, joint_array
from openpendant.simplemsg.pendant import (
    Activity,
    AuthorityBeat,
    Enabling,
    EnablingPosition,
    JogEnd,
    JogEnded,
    JogSpace,
    JogStart,
    Management,
    State,
)
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


class JoggedCell:
    def __init__(self) -> None:
        self.cell = EmulatedCell(has_surroundings=True, modes={"initial": "manual_high"})
        self.pendant: Pendant = self.cell.pendant("keys", state_rate=100.0)
        assert self.pendant.take() is V.ACCEPTED
        self.presses = 0
        self.hold(100)

    def hold(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 10):
            self.pendant.send(AuthorityBeat())
            self.pendant.send(Enabling(EnablingPosition.HELD))
            self.cell.wait(10)

    def press(self) -> V | None:
        self.presses += 1
        sequence = self.pendant.all(State)[-1].sequence
        rates = joint_array((1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        message = JogStart(
            self.pendant._next(), self.presses, sequence, 0.15, JogSpace.JOINTS, "", 6, rates
        )
        return self.pendant.code(message)

    def repeat(self, milliseconds: int) -> list[V | None]:
        """Press every 30 ms, as a key that is held in a terminal does."""
        codes = []
        for _ in range(0, milliseconds, 30):
            codes.append(self.press())
            self.hold(30)
        return codes

    def ask(self, op: str, **fields: Any) -> None:
        body = json.dumps({"op": op, **fields}).encode()
        replies = self.pendant.send(Management(self.pendant._next(), body))
        assert [r.reply_code for r in replies if isinstance(r, Management)] == [ReplyCode.SUCCESS]

    def swap_tools(self) -> None:
        view = self.cell.core.environment
        assert view is not None
        view.world._view.surround(view.world.frames, view.world.scene)


def add_to_the_scene(jogged: JoggedCell) -> None:
    jogged.ask("scene.add", object=BALL, expected_revision=0)


def swap_tools(jogged: JoggedCell) -> None:
    jogged.swap_tools()


@pytest.mark.parametrize("change", [add_to_the_scene, swap_tools])
def test_a_key_that_repeats_does_not_jog_on_in_the_surroundings_of_before(
    change: Callable[[JoggedCell], None],
) -> None:
    jogged = JoggedCell()
    assert jogged.repeat(300) == [V.ACCEPTED] * 10
    began = jogged.cell.core.cell.driving.driven_jog
    change(jogged)
    codes = jogged.repeat(900)
    assert codes[0] is V.MOVING
    rested = codes.index(V.ACCEPTED)
    assert set(codes[:rested]) == {V.MOVING}
    assert set(codes[rested:]) == {V.ACCEPTED}
    driven = jogged.cell.core.cell.driving.driven_jog
    assert driven is not None
    assert driven is not began
