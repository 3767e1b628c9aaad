"""Promise 30: canaries in every field for a secret, and no trace of them in anything written."""

import asyncio
import base64
import io
import json
import logging
from collections.abc import Awaitable, Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import pytest
from rigs.clock.busy_machine import PATIENCE
from rigs.peers.server_clients import hello
from rigs.peers.tls_certificates import make_certificate
from rigs.processes.app_on_loop import until
from rigs.processes.guarded_server import PASSWORDS, GuardedServer, guarded_server

from openpendant.server.cli.audit_commands import main as audit
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Role
from openpendant.simplemsg.pendant import AccountRole, Login, LoginKind
from openpendant.tools.packets.live.endpoints import Endpoint
from openpendant.tools.packets.live.proxy import Pair
from openpendant.tools.packets.record import PacketRecorder
from openpendant.tools.packets.rerun import main as rerun
from openpendant.tools.packets.show import main as show
from openpendant.tools.pendants.client import PendantClient, Refused

pytestmark = pytest.mark.realtime

WRONG = "canary-that-is-wrong-5511"
NEW = "canary-of-a-new-one-8080"
NEWER = "canary-of-a-newer-one-4747"
REFUSED = "nina-canary-with-a-name"
WRONG_CODE = "CANARYCODE"
WAITING = "canary-that-waits-in-line-6262"
NAME = "canary-in-the-name-3838"
"""A password typed into the field of the name."""


@dataclass
class Lesson:
    """What was typed and shown while every secret was used once, and what both ends said of it."""

    secrets: list[str] = field(default_factory=lambda: [*PASSWORDS.values()])
    told: list[str] = field(default_factory=list)

    async def fails(self, attempt: object) -> None:
        assert asyncio.iscoroutine(attempt)
        with pytest.raises(Refused) as refused:
            await attempt
        self.told.append(repr(refused.value) + str(refused.value))


async def wait_in_line(server: GuardedServer, port: int) -> Lesson:
    """Have many wait for one check: some leave, some fail, one is locked out.

    Returns:
        Told is what the password worker and its queue would show of those that wait.
    """
    lines = [await asyncio.open_connection("127.0.0.1", port) for _ in range(9)]
    conversations = [
        Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=65_532) for _ in lines
    ]
    for number, ((_, writer), spoken) in enumerate(zip(lines, conversations, strict=True)):
        name = NAME if number < 6 else f"nobody {number}"
        writer.write(spoken.send(hello("in line")))
        writer.write(spoken.send(Login(1, LoginKind.PASSWORD, name, WAITING)))
    worker = server.access._passwords
    await until(lambda: len(worker._queue) >= 4, within=PATIENCE)
    shown: list[str] = []
    while len(worker._queue):
        queue = vars(worker._queue)
        shown.append(repr(vars(worker)) + repr(queue) + repr(vars(server.app.login)))
        if len(shown) == 1 or len(worker._queue) == 5:
            lines.pop()[1].close()
        await asyncio.sleep(0.02)
    for reader, writer in lines:
        shown.append(repr(await reader.read(65_536)))
        writer.close()
    assert len(shown) > 4
    return Lesson(secrets=[*PASSWORDS.values(), WAITING], told=shown)


async def hold(port: int) -> Lesson:
    lesson, connect = Lesson(), PendantClient.connect
    async with (
        await connect(port=port, user="ann", password=PASSWORDS["ann"]) as ann,
        await connect(port=port, user="otto", password=PASSWORDS["otto"], state_rate=50) as otto,
        await connect(port=port, client="guest") as guest,
    ):
        await lesson.fails(guest.login("otto", password=WRONG))
        await lesson.fails(guest.login("Mia", pairing=WRONG_CODE))
        code = await ann.issue_pairing_code()
        await guest.login("Mia", pairing=code)
        await lesson.fails(ann.add_account("nina", AccountRole.OPERATOR, REFUSED))
        await ann.add_account("nina", AccountRole.OPERATOR, NEW)
        await ann.set_password("nina", NEWER)
        async with await connect(port=port, user="nina", password=NEWER):
            pass
        for request in ("access.whoami", "access.sessions", "users.list", "snapshot", "why"):
            lesson.told.append(json.dumps(await ann.manage({"op": request})))
        await ann.manage({"op": "users.remove", "name": "nina"})
        await otto.wait_until(lambda state: state.motion_possible == 1)
        async with otto.control():
            goal = [angle + 0.02 for angle in otto.joints()]
            await (await otto.move_joints(goal, speed=0.5)).done()
        await otto.stop("the lesson is over")
        await lesson.fails(otto.manage({"op": "users.list"}))
        lesson.told += [repr(await otto.next_state()), repr(vars(otto)), repr(vars(ann))]
    lesson.secrets += [WRONG, WRONG_CODE, NEW, NEWER, REFUSED, code, code.replace("-", "")]
    return lesson


def forms(secret: str) -> Iterator[bytes]:
    """Yield how a secret may stand in a file: as it is, hexadecimal, or in the midst of base64."""
    data = secret.encode()
    for text in (secret, data.hex(), data.hex(" ")):
        yield text.encode()
    if len(data) < 12:
        return  # too little of a pairing code is left without the ends
    for before in range(3):
        # The first and last signs depend on the neighbours.
        yield base64.b64encode(b"\0" * before + data)[4:-4]


def traces(secrets: list[str], written: dict[str, bytes]) -> set[tuple[str, int]]:
    return {
        (name, number)
        for name, content in written.items()
        for number, secret in enumerate(secrets)
        if any(form in content for form in forms(secret))
    }


@pytest.mark.parametrize("neighbour", ["", "x", "xy"])
def test_the_search_finds_a_secret_in_every_form(neighbour: str) -> None:
    said = f"{neighbour}{WRONG} and more".encode()
    for content in (said, said.hex().encode(), said.hex(" ").encode(), base64.b64encode(said)):
        assert traces([NEW, WRONG], {"file": content}) == {("file", 1)}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def printed(server: GuardedServer, trace: Path) -> bytes:
    output = io.StringIO()
    with redirect_stdout(output), redirect_stderr(output):
        assert rerun([str(server.journal), "--state"]) == 0
        assert audit(["verify", str(server.audit)]) == 0
        audit(["show", str(server.audit)])
        show([str(trace)])
    return output.getvalue().encode()


class Lived(NamedTuple):
    """What was done with a server that is gone, and all that it left and tools would show of it."""

    lesson: Lesson
    written: dict[str, bytes]


Doing = Callable[[GuardedServer, int], Awaitable[Lesson]]


async def _live(folder: Path, doing: Doing) -> Lived:
    trace = folder / "trace.jsonl"
    async with guarded_server(folder) as server:
        here = Endpoint("127.0.0.1", server.port)
        recorder = PacketRecorder([Pair(Endpoint("127.0.0.1", 0), here)], str(trace))
        (port,) = await recorder.start()
        lesson = await doing(server, port)
        await recorder.close()
        dump = repr(vars(server.app)) + repr(server.app.login.accounts)
    written = contents(folder)
    written["tools"] = await asyncio.to_thread(printed, server, trace)
    written["dump"] = dump.encode()
    written["told"] = "\n".join(lesson.told).encode()
    return Lived(lesson, written)


def _lived(folder: Path, doing: Doing) -> Lived:
    log, root = io.StringIO(), logging.getLogger()
    handler, level = logging.StreamHandler(log), root.level
    root.addHandler(handler)
    root.setLevel(logging.DEBUG)
    try:
        found = asyncio.run(_live(folder, doing))
    finally:
        root.removeHandler(handler)
        root.setLevel(level)
    found.written["log"] = log.getvalue().encode()
    return found


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Lived:
    return _lived(tmp_path_factory.mktemp("taught"), lambda _, port: hold(port))


@pytest.fixture(scope="module")
def waited(tmp_path_factory: pytest.TempPathFactory) -> Lived:
    return _lived(tmp_path_factory.mktemp("waited"), wait_in_line)


@pytest.mark.parametrize("lived", ["taught", "waited"])
def test_promise_30_no_secret_is_in_anything_that_is_written(
    lived: str, request: pytest.FixtureRequest
) -> None:
    """Journal, log, audit log, store, recorded packets, answers, errors, dumps, tools' output."""
    found: Lived = request.getfixturevalue(lived)
    assert traces(found.lesson.secrets, found.written) == set()
    assert all(len(found.written[name]) > 5_000 for name in ("journal", "trace.jsonl", "tools"))
    assert b"controller motion link is up" in found.written["log"]


def test_promise_30_a_name_that_may_be_a_password_is_in_nothing_but_what_repeats_a_run(
    waited: Lived,
) -> None:
    """The count of failures goes by it, so what repeats a run holds it: docs/access.md."""
    found = {name for name, _ in traces([NAME], waited.written)}
    assert found == {"journal", "trace.jsonl", "tools"}
    assert b"locked-out" in waited.written["audit.jsonl"]


async def test_promise_30_no_line_of_the_tls_key_is_in_anything_that_is_written(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    keys, files = tmp_path / "keys", tmp_path / "files"
    keys.mkdir()
    files.mkdir()
    certificate, key = make_certificate(keys)
    async with guarded_server(files, tls={"certificate": str(certificate), "key": str(key)}) as on:
        _, writer = await asyncio.open_connection("127.0.0.1", on.port)
        writer.write(b"no hello of TLS" * 10)
        await asyncio.sleep(0.3)
        writer.close()
        dump = repr(vars(on.app))
    written = contents(files)
    written |= {"log": caplog.text.encode(), "dump": dump.encode()}
    secret_lines = key.read_text().splitlines()[1:-1]
    assert traces(secret_lines, written) == set()


def test_the_audit_log_tells_who_did_what(taught: Lived) -> None:
    entries = [json.loads(line) for line in taught.written["audit.jsonl"].splitlines()]
    told = {(entry["event"], entry["who"]) for entry in entries}
    assert told >= {
        ("server-started", ""),
        ("login", "ann"),
        ("login", "otto"),
        ("login-failed", ""),
        ("pairing-issued", "ann"),
        ("paired", "Mia"),
        ("account-changed", "ann"),
        ("authority-taken", "otto"),
        ("motion-began", "otto"),
        ("motion-ended", "otto"),
        ("authority-ended", "otto"),
        ("stop", "otto"),
        ("refused", "otto"),
        ("server-stopped", ""),
    }
