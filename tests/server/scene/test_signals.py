from collections import deque

import pytest
from rigs.cells.expectations import known, refusal_from
from rigs.cells.server_rig import MS

from openpendant.controller_emulator.core.signals import DigitalSignals
from openpendant.server.events.effects import Effect, QueryController
from openpendant.server.programs.interpreter.run_events import OfferedSignals
from openpendant.server.refusal import Refusal
from openpendant.server.scene.signals import CellSignals
from openpendant.simplemsg import refused
from openpendant.simplemsg.pendant import ReadSignals, WriteOutputs
from openpendant.simplemsg.verdicts import VerdictCode as V


class SignalRig:
    def __init__(self, *, is_offered: bool = True) -> None:
        self.controller = DigitalSignals(20, 18)
        self.signals = CellSignals(is_offered=is_offered)
        self.now = 10**9
        self.answers = True
        self.asked: deque[ReadSignals | WriteOutputs] = deque()
        self.signals.link_changed(True, self.now)

    def perform(self, outgoing: list[Effect] | Refusal) -> None:
        assert not isinstance(outgoing, Refusal)
        for item in outgoing:
            assert isinstance(item, QueryController)
            assert isinstance(item.message, ReadSignals | WriteOutputs)
            self.asked.append(item.message)
        while self.answers and self.asked:
            reply = known(self.controller.answer(self.asked.popleft()))
            self.signals.answered(reply, self.now)

    def wait(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 10):
            self.now += 10 * MS
            self.perform(self.signals.tick(self.now))


@pytest.fixture
def rig() -> SignalRig:
    made = SignalRig()
    made.wait(200)
    return made


def test_inputs_of_every_bank_are_read(rig: SignalRig) -> None:
    rig.controller.inputs[3] = rig.controller.inputs[19] = True
    rig.wait(100)
    on = [signal for signal in range(20) if rig.signals.input(signal, rig.now)]
    assert on == [3, 19]


def test_a_write_is_done_and_seen_at_once(rig: SignalRig) -> None:
    rig.perform(rig.signals.set_output(17, True, rig.now))
    assert rig.controller.outputs[17]
    assert rig.signals.output(17, rig.now) is True
    rig.perform(rig.signals.set_output(17, False, rig.now))
    assert rig.signals.output(17, rig.now) is False


def test_whoever_writes_is_told_when_it_was_done(rig: SignalRig) -> None:
    told: list[Refusal | None] = []

    def tell(refusal: Refusal | None, now: int) -> list[Effect]:
        told.append(refusal)
        return []

    rig.answers = False
    rig.perform(rig.signals.set_output(1, True, rig.now, tell))
    assert told == []
    rig.signals.answered(refused(WriteOutputs(0, 2, 2)), rig.now)
    assert [refusal_from(refusal).code for refusal in told] == [V.CONTROLLER_REFUSED]


@pytest.mark.parametrize("signal", [-1, 20, 512])
def test_an_input_that_is_not_there_is_refused_with_what_is(rig: SignalRig, signal: int) -> None:
    result = refusal_from(rig.signals.input(signal, rig.now))
    assert result.code is V.NO_SIGNAL
    assert "0 to 19" in result.text


def test_a_value_that_was_read_long_ago_is_none(rig: SignalRig) -> None:
    rig.answers = False
    rig.wait(400)
    assert refusal_from(rig.signals.input(0, rig.now)).code is V.SIGNALS_UNAVAILABLE


def test_a_controller_that_does_not_answer_is_asked_again(rig: SignalRig) -> None:
    rig.answers = False
    rig.wait(700)
    rig.asked.clear()
    rig.answers = True
    rig.wait(1_000)
    assert rig.signals.input(0, rig.now) is False


def test_a_lost_connection_forgets_all(rig: SignalRig) -> None:
    rig.signals.link_changed(False, rig.now)
    assert refusal_from(rig.signals.input(0, rig.now)).code is V.SIGNALS_UNAVAILABLE
    assert rig.signals.inputs == ()


def test_a_controller_that_offers_none_is_never_asked() -> None:
    rig = SignalRig(is_offered=False)
    rig.wait(500)
    assert refusal_from(rig.signals.input(0, rig.now)).code is V.SIGNALS_UNAVAILABLE


def test_reading_a_second_costs_twenty_rounds(rig: SignalRig) -> None:
    rig.answers = False
    asked = 0
    for _ in range(100):
        rig.now += 10 * MS
        rig.perform(rig.signals.tick(rig.now))
        while rig.asked:
            asked += 1
            reply = known(rig.controller.answer(rig.asked.popleft()))
            rig.signals.answered(reply, rig.now)
    assert asked == 40


def test_what_is_offered_is_known_once_the_controller_has_said_it() -> None:
    rig = SignalRig()
    offers = [rig.signals.offer]
    rig.wait(200)
    offers.append(rig.signals.offer)
    rig.signals.link_changed(False, rig.now)
    offers.append(rig.signals.offer)
    assert offers == [None, OfferedSignals(inputs=20, outputs=18), None]
    assert refusal_from(SignalRig(is_offered=False).signals.offer).code is V.SIGNALS_UNAVAILABLE
