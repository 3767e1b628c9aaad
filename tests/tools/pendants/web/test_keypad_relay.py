"""The line of the keypad in a page: one page and one bridge at a time, of this machine alone."""

import asyncio
import socket
from collections.abc import AsyncIterator, Iterator
from contextlib import closing, contextmanager

import pytest
from aiohttp import ClientWebSocketResponse, WSServerHandshakeError
from rigs.processes.web_gateway import LOOPBACK, WEB, GatewayRig, Tab, running_gateway

from openpendant.tools.pendants.settings_file import SettingsRefused
from openpendant.tools.pendants.web import cli
from openpendant.tools.pendants.web.keypad_relay import GOING_AWAY, MOST_WAITING, SLOW, TAKEN
from openpendant.tools.pendants.web.settings import settings_of

PATIENCE = 5.0
ELSEWHERE = "192.0.2.7"
HELLO = b"\0hello\0"


@pytest.fixture(name="gateway")
async def _gateway() -> AsyncIterator[GatewayRig]:
    async with running_gateway(1, keypad=0) as rig:
        yield rig


async def page_of(gateway: GatewayRig, **headers: str) -> ClientWebSocketResponse:
    """Open the line as the page of the gateway does."""
    sent = {"Origin": gateway.page.rstrip("/")}
    sent |= {key.replace("_", "-"): value for key, value in headers.items()}
    opened = await gateway.session.ws_connect(f"{gateway.page}keypad", headers=sent)
    gateway.tabs.append(Tab(opened))
    return opened


class Bridge:
    """What comes to the port of the keypad."""

    def __init__(self, taken: socket.socket) -> None:
        self._socket = taken

    async def send(self, data: bytes) -> None:
        await asyncio.get_running_loop().sock_sendall(self._socket, data)

    async def read(self, count: int) -> bytes:
        """Return so many bytes, fewer where the line ends before."""
        loop, data = asyncio.get_running_loop(), b""
        while len(data) < count:
            try:
                more = await asyncio.wait_for(loop.sock_recv(self._socket, 65_536), PATIENCE)
            except ConnectionResetError:
                break
            if not more:
                break
            data += more
        return data

    async def is_over(self) -> bool:
        """Wait for the end of the line; return whether nothing more had come."""
        return await self.read(1) == b""


@contextmanager
def at_port(gateway: GatewayRig) -> Iterator[Bridge]:
    """Come as a bridge does."""
    port = int(gateway.gateway.keypad_port.rpartition(":")[2])
    with closing(socket.create_connection((LOOPBACK, port), PATIENCE)) as taken:
        taken.setblocking(False)
        yield Bridge(taken)


async def hears(page: ClientWebSocketResponse, bridge: Bridge) -> None:
    """Have page and bridge hear each other."""
    await bridge.send(HELLO)
    assert await page.receive_bytes(timeout=PATIENCE) == HELLO
    await page.send_bytes(b"ok")
    assert await bridge.read(2) == b"ok"


async def ended(page: ClientWebSocketResponse) -> int | None:
    """Wait for the end of a page's line; return its code."""
    while not page.closed:
        await page.receive(timeout=PATIENCE)
    return page.close_code


async def test_bytes_of_page_and_bridge_pass_as_they_are(gateway: GatewayRig) -> None:
    page, everything = await page_of(gateway), bytes(range(256))
    with at_port(gateway) as bridge:
        await bridge.send(everything)
        assert await page.receive_bytes(timeout=PATIENCE) == everything
        await page.send_bytes(everything)
        assert await bridge.read(256) == everything


async def test_a_page_that_is_gone_is_a_pulled_cable(gateway: GatewayRig) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        await hears(page, bridge)
        await page.close()
        assert await bridge.is_over()


async def test_a_bridge_finds_no_keypad_without_a_page(gateway: GatewayRig) -> None:
    with at_port(gateway) as bridge:
        assert await bridge.is_over()


async def test_a_bridge_comes_again_and_gets_nothing_of_before(gateway: GatewayRig) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        await hears(page, bridge)
    await page.send_bytes(b"to nobody")
    while True:
        with at_port(gateway) as bridge:
            await bridge.send(HELLO)
            try:
                assert await page.receive_bytes(timeout=0.5) == HELLO
            except TimeoutError:
                continue  # the end of the first one was not noticed yet
            await page.send_bytes(b"now")
            assert await bridge.read(3) == b"now"
            return


async def test_a_second_bridge_is_sent_away_and_the_first_stays(gateway: GatewayRig) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        await hears(page, bridge)
        with at_port(gateway) as other:
            assert await other.is_over()
        await hears(page, bridge)


async def test_who_says_nothing_keeps_no_bridge_away(gateway: GatewayRig) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as silent, at_port(gateway) as bridge:
        assert await silent.is_over()
        await hears(page, bridge)


async def test_a_page_of_a_stranger_that_speaks_http_to_the_port_is_no_bridge(
    gateway: GatewayRig,
) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as stranger:
        await stranger.send(b"POST / HTTP/1.1\r\nContent-Length: 7\r\n\r\n" + HELLO)
        assert await stranger.is_over()
        with at_port(gateway) as bridge:
            await hears(page, bridge)


async def test_a_second_page_waits_until_the_first_is_gone(gateway: GatewayRig) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        assert await ended(await page_of(gateway)) == TAKEN
        await hears(page, bridge)
        await page.close()
        assert await bridge.is_over()
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        await hears(page, bridge)


@pytest.mark.parametrize("sent", ["text", bytes(MOST_WAITING + 1)], ids=["text", "too much"])
async def test_a_page_that_sends_what_is_no_line_of_a_keypad_is_ended(
    gateway: GatewayRig, sent: str | bytes
) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        await hears(page, bridge)
        await (page.send_str(sent) if isinstance(sent, str) else page.send_bytes(sent))
        await ended(page)
        assert await bridge.is_over()


async def test_a_bridge_that_reads_nothing_is_sent_away(gateway: GatewayRig) -> None:
    page, sent = await page_of(gateway), 0
    with at_port(gateway) as bridge:
        await hears(page, bridge)
        for _ in range(2_000):
            await page.send_bytes(bytes(MOST_WAITING // 2))
            sent += MOST_WAITING // 2
        assert len(await bridge.read(sent)) < sent
        assert not page.closed


async def test_a_bridge_that_says_more_than_a_page_takes_ends_both(gateway: GatewayRig) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        await hears(page, bridge)
        await bridge.send(bytes(4 * MOST_WAITING))
        assert await ended(page) == SLOW
        assert await bridge.is_over()


async def test_only_a_browser_of_this_machine_is_told_of_it_and_gets_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def is_guarded(*_: object) -> None:
        """Take the server for one that demands logins; there is none."""

    monkeypatch.setattr(cli, "check_logins_are_demanded", is_guarded)
    async with running_gateway(1, WEB, keypad=0, proxies=[LOOPBACK]) as rig:
        told = {}
        for address in (ELSEWHERE, LOOPBACK):
            answer = await rig.session.get(
                f"{rig.page}servers", headers={"X-Forwarded-For": address}
            )
            told[address] = (await answer.json()).get("keypad")
        assert told == {ELSEWHERE: None, LOOPBACK: True}
        with pytest.raises(WSServerHandshakeError) as refused:
            await page_of(rig, X_Forwarded_For=ELSEWHERE)
        assert refused.value.status == 403
        page = await page_of(rig, X_Forwarded_For=LOOPBACK)
        with at_port(rig) as bridge:
            await hears(page, bridge)


async def test_a_strangers_page_gets_no_keypad(gateway: GatewayRig) -> None:
    with pytest.raises(WSServerHandshakeError) as refused:
        await page_of(gateway, Origin="http://evil.example")
    assert refused.value.status == 403


async def test_without_the_option_there_is_no_keypad() -> None:
    async with running_gateway(1) as rig:
        with pytest.raises(WSServerHandshakeError) as refused:
            await page_of(rig)
        assert refused.value.status == 404
        assert rig.gateway.keypad_port == ""


async def test_a_gateway_that_ends_ends_both(gateway: GatewayRig) -> None:
    page = await page_of(gateway)
    with at_port(gateway) as bridge:
        await hears(page, bridge)
        code, _ = await asyncio.gather(ended(page), gateway.gateway.close())
        assert code == GOING_AWAY
        assert await bridge.is_over()


def test_a_port_beyond_all_ports_is_refused() -> None:
    servers = [{"name": "cell", "address": "127.0.0.1:1"}]
    with pytest.raises(SettingsRefused, match="keypad"):
        settings_of({"servers": servers, "keypad": 65_536}, "test")
