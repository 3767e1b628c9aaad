"""A pendant's hands in tests: keys that are held, an enabling device that is squeezed.

Beats go out every 50 ms while time passes, as a real pendant sends them.
"""

from typing import Any

from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import ServerRig
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg import JointTrajPtFull, joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode

BEAT_TICKS = 5


class JogPad:
    """One pendant that holds the authority and sees every state message."""

    def __init__(
        self,
        rig: ServerRig,
        client: str = "pad",
        *,
        takes: bool = True,
        silence: float = 0.25,
        version: int = messages.PROTOCOL_VERSION,
    ) -> None:
        """Connect; declare for how long the enabling device may be silent [s], 0 for nothing."""
        self.rig = rig
        self.pendant: Pendant = rig.pendant(client, state_rate=100.0, version=version)
        self.press_number = 0
        self.beat_number = 0
        self.is_pressed = False
        self.squeezes = False
        if silence and version > 2:
            assert self.declare(silence) is VerdictCode.ACCEPTED
            self.pendant.got.clear()
        if takes:
            assert self.pendant.take() is VerdictCode.ACCEPTED
        rig.wait(10)

    def _request(self) -> int:
        self.pendant.last_request += 1
        return self.pendant.last_request

    @property
    def newest_state(self) -> messages.State:
        return self.pendant.all(messages.State)[-1]

    # One message each.

    def declare(self, silence: float) -> VerdictCode | None:
        unwanted = messages.Notices.UNWANTED
        return self.pendant.code(messages.Declare(self._request(), silence, unwanted, "en"))

    def squeeze(self, position: int = messages.EnablingPosition.HELD) -> None:
        self.squeezes = position == messages.EnablingPosition.HELD
        self.pendant.send(messages.Enabling(position))

    def let_go(self) -> None:
        self.squeeze(messages.EnablingPosition.RELEASED)

    def press(
        self,
        *rates: float,
        deadline: float = 0.15,
        number: int | None = None,
        quoted: int = 0,
        space: int = messages.JogSpace.JOINTS,
        frame: str = "",
    ) -> VerdictCode | None:
        """Press a key; further keys add up. Quotes the newest state unless told otherwise."""
        self.press_number = self.press_number + 1 if number is None else number
        self.beat_number = 0
        message = messages.JogStart(
            request_id=self._request(),
            press=self.press_number,
            state_sequence=quoted or self.newest_state.sequence,
            deadline=deadline,
            space=space,
            frame=frame,
            value_count=len(rates),
            values=joint_array(rates),
        )
        code = self.pendant.code(message)
        self.is_pressed = code is VerdictCode.ACCEPTED
        return code

    def beat(self, number: int | None = None, press: int | None = None) -> None:
        self.beat_number += 1
        press = self.press_number if press is None else press
        self.pendant.send(messages.JogBeat(press, self.beat_number if number is None else number))

    def release(self) -> VerdictCode | None:
        self.is_pressed = False
        return self.pendant.code(messages.JogRelease(self._request(), self.press_number))

    def mode(self, mode: int) -> VerdictCode | None:
        return self.pendant.mode(mode)

    def speed(self, override: float, tool_speed: float = 0.0) -> VerdictCode | None:
        return self.pendant.speed(override, tool_speed)

    def control(self, action: messages.MotionControlAction) -> VerdictCode | None:
        return self.pendant.control(action)

    def home(self) -> VerdictCode | None:
        return self.pendant.code(messages.Home(self._request(), 1.0, "home"))

    # Time.

    def hold(self, milliseconds: int) -> None:
        """Keep on doing what the hands do."""
        for tick in range(milliseconds // 10):
            if tick % BEAT_TICKS == 0:
                self.pendant.send(messages.AuthorityBeat())
                if self.squeezes:
                    self.pendant.send(messages.Enabling(messages.EnablingPosition.HELD))
                if self.is_pressed:
                    self.beat()
            self.rig.wait(10)


class EmulatedPad(JogPad):
    """The same hands at an emulated robot, in a manual mode with the enabling device squeezed."""

    def __init__(
        self, cell: EmulatedCell, mode: int = messages.OperatingMode.MANUAL_REDUCED
    ) -> None:
        super().__init__(cell)  # type: ignore[arg-type]  # it keeps time and lets pendants in, too
        self.cell = cell
        self.turn_to(mode)

    def turn_to(self, mode: int) -> None:
        """Turn the selector, for which the enabling device is let go once."""
        self.let_go()
        assert self.mode(mode) is VerdictCode.ACCEPTED
        self.squeeze()
        self.hold(50)

    def ask(self, op: str, **fields: Any) -> dict[str, Any]:
        """Make a management request that is fulfilled on this call stack; return the answer."""
        answer = self.pendant.ask(op, **fields)
        assert "code" not in answer, answer
        return answer

    def finish(self) -> None:
        """Keep on until the robot has nothing more to do."""
        for _ in range(1_200):
            self.hold(50)
            if self.cell.core.cell.activity is messages.Activity.IDLE:
                return
        raise AssertionError("the motion does not end")

    @property
    def sent(self) -> list[JointTrajPtFull]:
        return [each for each in self.cell.sent if isinstance(each, JointTrajPtFull)]
