"""A pendant's hands in tests: keys that are held, an enabling device that is squeezed.

Beats go out every 50 ms while time passes, as a real pendant sends them.
"""

from __future__ import annotations

from rigs.cells.server_rig import ServerRig
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    AuthorityBeat,
    Enabling,
    EnablingPosition,
    Home,
    JogBeat,
    JogRelease,
    JogSpace,
    JogStart,
    MotionControl,
    MotionControlAction,
    SetMode,
    SetSpeed,
    State,
)
from openpendant.simplemsg.verdicts import VerdictCode

BEAT_TICKS = 5


class JogPad:
    """One pendant that holds the authority and sees every state message."""

    def __init__(self, rig: ServerRig, client: str = "pad", *, takes: bool = True) -> None:
        self.rig = rig
        self.pendant: Pendant = rig.pendant(client, state_rate=100.0)
        self.press_number = 0
        self.beat_number = 0
        self.is_pressed = False
        self.squeezes = False
        if takes:
            assert self.pendant.take() is VerdictCode.ACCEPTED
        rig.wait(10)

    def _request(self) -> int:
        self.pendant.last_request += 1
        return self.pendant.last_request

    @property
    def newest_state(self) -> State:
        return self.pendant.all(State)[-1]

    # One message each.

    def squeeze(self, position: int = EnablingPosition.HELD) -> None:
        self.squeezes = position == EnablingPosition.HELD
        self.pendant.send(Enabling(position))

    def let_go(self) -> None:
        self.squeeze(EnablingPosition.RELEASED)

    def press(
        self, *rates: float, deadline: float = 0.15, number: int | None = None, quoted: int = 0
    ) -> VerdictCode | None:
        """Press a key; further keys add up. Quotes the newest state unless told otherwise."""
        self.press_number = self.press_number + 1 if number is None else number
        self.beat_number = 0
        message = JogStart(
            request_id=self._request(),
            press=self.press_number,
            state_sequence=quoted or self.newest_state.sequence,
            deadline=deadline,
            space=JogSpace.JOINTS,
            frame="",
            value_count=len(rates),
            values=joint_array(rates),
        )
        code = self.pendant.code(message)
        self.is_pressed = code is VerdictCode.ACCEPTED
        return code

    def beat(self, number: int | None = None, press: int | None = None) -> None:
        self.beat_number += 1
        press = self.press_number if press is None else press
        self.pendant.send(JogBeat(press, self.beat_number if number is None else number))

    def release(self) -> VerdictCode | None:
        self.is_pressed = False
        return self.pendant.code(JogRelease(self._request(), self.press_number))

    def mode(self, mode: int) -> VerdictCode | None:
        return self.pendant.code(SetMode(self._request(), mode))

    def speed(self, override: float, tool_speed: float = 0.0) -> VerdictCode | None:
        return self.pendant.code(SetSpeed(self._request(), override, tool_speed))

    def control(self, action: MotionControlAction) -> VerdictCode | None:
        return self.pendant.code(MotionControl(self._request(), action))

    def home(self) -> VerdictCode | None:
        return self.pendant.code(Home(self._request(), 1.0, "home"))

    # Time.

    def hold(self, milliseconds: int) -> None:
        """Keep on doing what the hands do."""
        for tick in range(milliseconds // 10):
            if tick % BEAT_TICKS == 0:
                self.pendant.send(AuthorityBeat())
                if self.squeezes:
                    self.pendant.send(Enabling(EnablingPosition.HELD))
                if self.is_pressed:
                    self.beat()
            self.rig.wait(10)
