"""The client's enabling device (training) beside its presses, and what it declares."""

import asyncio
import itertools

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer

from openpendant import simplemsg as wire
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient, Refused, WrongArgument

pytestmark = pytest.mark.virtual_clock

HELD = messages.EnablingPosition.HELD


class Writes:
    """What a client writes, by write."""

    def __init__(self, pendant: PendantClient, monkeypatch: pytest.MonkeyPatch) -> None:
        self.seen: list[list[wire.Arrival]] = []
        transport = pendant._conversation._transport
        assert transport is not None
        write = transport.write
        reader = wire.Connection(wire.Role.SERVER, wire.PENDANT, max_frame=65_532)

        def noted(data: bytes) -> None:
            self.seen.append(list(reader.receive(data)))
            write(data)

        monkeypatch.setattr(transport, "write", noted)

    def kinds(self, kind: type[wire.Message]) -> list[list[str]]:
        """Return the writes that hold a message of a kind, each as the names of its messages."""
        held = [write for write in self.seen if any(isinstance(each, kind) for each in write)]
        return [[type(each).__name__ for each in write] for write in held]


async def test_a_press_and_its_beats_go_out_in_one_write_with_the_enabling_device_in_front(
    pendant: PendantClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    writes = Writes(pendant, monkeypatch)
    async with pendant.enabling(), pendant.jog({0: 1.0}) as jog:
        await jog.hold(0.5)
        await jog.aim({0: 0.5})
        await jog.hold(0.3)
    assert writes.kinds(messages.JogStart) == [["Enabling", "JogStart"]] * 2
    beats = writes.kinds(messages.JogBeat)
    assert len(beats) >= 14
    assert {(first, *{*rest}) for first, *rest in beats} == {("Enabling", "JogBeat")}


async def test_a_device_whose_signs_go_out_with_beats_writes_none_of_its_own(
    pendant: PendantClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    writes = Writes(pendant, monkeypatch)
    async with pendant.enabling(), pendant.jog({0: 1.0}) as jog:
        began = len(writes.seen)
        await jog.hold(0.9)
        alone = [write for write in writes.seen[began:] if len(write) == 1]
    assert [write for write in alone if isinstance(write[0], messages.Enabling)] == []


async def test_a_device_is_repeated_by_itself_again_once_the_press_has_ended(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    async with pendant.enabling():
        async with pendant.jog({0: 1.0}) as jog:
            await jog.hold(0.2)
        await asyncio.sleep(0.5)
    times = [at for at, each in server.got if isinstance(each, messages.Enabling)]
    assert max(after - before for before, after in itertools.pairwise(times)) < 0.07


@pytest.mark.parametrize("position", ["let_go", "press_through"])
async def test_a_device_that_is_not_held_goes_in_front_of_no_press(
    pendant: PendantClient, monkeypatch: pytest.MonkeyPatch, position: str
) -> None:
    writes = Writes(pendant, monkeypatch)
    async with pendant.enabling() as device:
        getattr(device, position)()
        async with pendant.jog({0: 1.0}):
            pass
    async with pendant.jog({0: 1.0}):
        pass
    assert writes.kinds(messages.JogStart) == [["JogStart"]] * 2


# What is declared.


async def test_a_client_declares_the_longest_silence_right_after_its_hello(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    first, second, *_ = [each for _, each in server.got]
    assert isinstance(first, messages.Hello)
    assert isinstance(second, messages.Declare)
    assert (second.enabling_deadline, second.notices, second.language) == (0.25, 0, "")
    assert pendant.ramp_time == 0.0  # the scripted server's


async def test_declaring_anew_returns_the_ramp_time(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    assert await pendant.declare(enabling_deadline=0.1, language="de") == 0.0
    declared = server.all(messages.Declare)[-1]
    assert declared.enabling_deadline == pytest.approx(0.1)
    assert declared.language == "de"


async def test_a_refused_declaration_is_raised(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    server.refusals[messages.Declare] = (VerdictCode.MOVING, "this connection moves the robot")
    with pytest.raises(Refused, match="MOVING"):
        await pendant.declare()


@pytest.mark.parametrize("deadline", [0.049, 0.2501, -0.1, float("nan"), float("inf")])
async def test_a_silence_out_of_bounds_is_never_sent(
    server: ScriptedPendantServer, pendant: PendantClient, deadline: float
) -> None:
    with pytest.raises(WrongArgument, match=r"accepted: 0, or 0\.05 to 0\.25"):
        await pendant.declare(enabling_deadline=deadline)
    assert len(server.all(messages.Declare)) == 1


async def test_a_declaration_that_a_server_does_not_take_is_told_to_the_loop(
    server: ScriptedPendantServer,
) -> None:
    told: list[str] = []
    loop = asyncio.get_running_loop()
    loop.set_exception_handler(lambda _, context: told.append(context["message"]))
    server.refusals[messages.Declare] = (VerdictCode.BAD_ARGUMENT, "no")
    async with await PendantClient.connect("127.0.0.1", server.port) as pendant:
        await pendant.next_state()
        assert pendant.ramp_time is None
    (text,) = told
    assert "does not take what was declared" in text
