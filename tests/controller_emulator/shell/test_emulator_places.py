"""Who beyond this machine is let in at an emulator, how often, and that nobody is displaced."""

import asyncio
import ipaddress
from unittest.mock import Mock

import pytest
from rigs.cells.controller_rig import ControllerRig

from openpendant.controller_emulator.shell.places import (
    BURST,
    MOST_AN_ADDRESS,
    MOST_RATES,
    MOST_STRANGERS,
    PER_SECOND,
    EmulatorNewcomer,
    EmulatorPlaces,
    EmulatorRates,
    counted_as,
)
from openpendant.controller_emulator.shell.service import Service
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.simplemsg import PENDANT, Ping, codec_for

OWN = "192.0.2.1"
SECOND = 1_000_000_000


class Arrivals:
    """The places of an emulator whose clock and connections are the test's."""

    def __init__(self) -> None:
        self.taken: list[str] = []
        self.now = 5 * SECOND
        self.places = EmulatorPlaces(lambda: self.taken, lambda: self.now)

    def come(self, address: str, after: int = SECOND) -> bool:
        """Connect some time [ns] after the last one; who is let in stays."""
        self.now += after
        is_in = self.places.lets_in(address, OWN)
        if is_in:
            self.taken.append(address)
        return is_in


@pytest.fixture
def arrivals() -> Arrivals:
    return Arrivals()


def test_one_address_has_so_many_places_and_others_have_theirs(arrivals: Arrivals) -> None:
    assert [arrivals.come("192.0.2.7") for _ in range(MOST_AN_ADDRESS + 1)] == [True] * 16 + [False]
    assert arrivals.come("192.0.2.8")
    arrivals.taken.remove("192.0.2.7")
    assert arrivals.come("192.0.2.7")


def test_all_other_machines_have_so_many_together_and_this_machine_is_not_counted(
    arrivals: Arrivals,
) -> None:
    hosts = [f"192.0.2.{10 + number // 16}" for number in range(MOST_STRANGERS)]
    assert all(arrivals.come(host) for host in hosts)
    assert not arrivals.come("192.0.2.99")
    for own in ("127.0.0.1", "127.8.8.8", "::1", "::ffff:127.0.0.1", OWN):
        assert all(arrivals.come(own, after=0) for _ in range(100))
    assert len(arrivals.taken) == MOST_STRANGERS + 500
    arrivals.taken.remove(hosts[0])
    assert arrivals.come("192.0.2.99")


def test_an_address_is_let_in_at_its_rate_and_others_at_theirs(arrivals: Arrivals) -> None:
    def comes_and_goes(address: str, after: int) -> bool:
        is_in = arrivals.come(address, after)
        arrivals.taken.clear()
        return is_in

    at_once = [comes_and_goes("192.0.2.7", 0) for _ in range(BURST + 10)]
    assert at_once == [True] * 20 + [False] * 10
    assert comes_and_goes("192.0.2.8", 0)
    # What was refused costs nothing: exactly ten a second come in, whoever tries a thousand times.
    tried = [comes_and_goes("192.0.2.7", SECOND // 1000) for _ in range(2000)]
    assert sum(tried) == 2 * PER_SECOND


@pytest.mark.parametrize(
    ("address", "group"),
    [
        ("127.0.0.1", ""),
        ("127.9.9.9", ""),
        ("::1", ""),
        ("", ""),
        ("::ffff:127.0.0.1", ""),
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::9", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
    ],
)
def test_what_an_address_is_counted_as(address: str, group: str) -> None:
    assert counted_as(address) == group


def test_an_address_is_parsed_once_however_many_connections_it_has(
    arrivals: Arrivals, monkeypatch: pytest.MonkeyPatch
) -> None:
    parse = Mock(side_effect=ipaddress.ip_address)
    monkeypatch.setattr(ipaddress, "ip_address", parse)
    counted_as.cache_clear()
    assert all(arrivals.come("192.0.2.7") for _ in range(MOST_AN_ADDRESS))
    parse.assert_called_once_with("192.0.2.7")


def test_the_rates_of_so_many_addresses_are_kept_and_the_oldest_is_forgotten() -> None:
    rates = EmulatorRates()
    for _ in range(BURST):
        assert rates.take("first", 0)
    assert not rates.take("first", 0)
    for number in range(MOST_RATES):
        assert rates.take(str(number), 0)
    assert rates.take("first", 0)


def test_a_refusal_is_told_and_a_thousand_are_not(
    arrivals: Arrivals, caplog: pytest.LogCaptureFixture
) -> None:
    for _ in range(1000):
        arrivals.come("192.0.2.7", after=SECOND // 1000)
    assert len(caplog.messages) == 1
    arrivals.come("192.0.2.7", after=10 * SECOND)
    assert (
        caplog.messages
        == [
            "a connection of 192.0.2.7 is refused: it has 16 already",
        ]
        * 2
    )


def connecting(address: str, own: str = OWN) -> Mock:
    transport = Mock(spec=asyncio.Transport)
    about = {"peername": (address, 40_000), "sockname": (own, 12_000), "socket": None}
    transport.get_extra_info.side_effect = about.get
    transport.is_closing.return_value = False
    transport.get_write_buffer_size.return_value = 0
    return transport


def test_whoever_is_refused_is_closed_at_once_and_never_becomes_a_link(arrivals: Arrivals) -> None:
    arrivals.taken = ["192.0.2.7"] * MOST_AN_ADDRESS
    link, transport = Mock(), connecting("192.0.2.7")
    EmulatorNewcomer(arrivals.places, link).connection_made(transport)
    transport.abort.assert_called_once_with()
    transport.set_protocol.assert_not_called()
    link.assert_not_called()


@pytest.mark.virtual_clock
async def test_nobody_displaces_the_one_that_streams_whoever_fills_all_places() -> None:
    settings = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0})
    rig = ControllerRig(now=round(asyncio.get_running_loop().time() * 1e9))
    service = Service(rig.controller, settings)
    places = service._places
    streaming = service.motion_link()
    streaming.connection_made(connecting("192.0.2.5"))
    served = connecting("127.0.0.1")
    for number in range(1000):
        EmulatorNewcomer(places, service.motion_link).connection_made(
            connecting(f"192.0.2.{100 + number % 100}")
        )
    assert len(service._motion_links) == MOST_STRANGERS
    assert streaming.is_open
    streaming.data_received(codec_for(PENDANT).encode(Ping()))
    EmulatorNewcomer(places, service.motion_link).connection_made(served)
    served.abort.assert_not_called()
    assert len(service._motion_links) == MOST_STRANGERS + 1
    await service.close()


@pytest.mark.virtual_clock
async def test_links_of_an_emulator_on_sockets_are_counted_by_nobody_but_their_own_machine() -> (
    None
):
    settings = EmulatorSettings.model_validate({"motion_port": 0, "state_port": 0})
    rig = ControllerRig(now=round(asyncio.get_running_loop().time() * 1e9))
    service = Service(rig.controller, settings)
    ports = await service.start()
    peers = [await asyncio.open_connection("127.0.0.1", ports.state) for _ in range(50)]
    await asyncio.sleep(0.1)
    assert len(service.state_links) == 50
    for _, writer in peers:
        writer.close()
    await service.close()
    await asyncio.sleep(0)
