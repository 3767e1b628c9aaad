"""The whole server with accounts: secrets, journal, audit log, lock-out, TLS; real sockets."""

from __future__ import annotations

import asyncio
import io
import json
import logging
import shutil
import ssl
import subprocess
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest
from guarded_server import PASSWORDS, guarded_server

from openpendant.server.access.audit_cli import main as audit_main
from openpendant.server.access.cli import main as users_main
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Connection,
    Message,
    Role,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    AccountRole,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Hello,
    JogBeat,
    JogSpace,
    JogStart,
    JointMove,
    ResetStop,
    SetSpeed,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.packets.rerun import main as rerun
from openpendant.tools.pendants.client import PendantClient, Refused
from openpendant.tools.pendants.failures import PendantError

OPENSSL = shutil.which("openssl")
pytestmark = [pytest.mark.realtime, pytest.mark.asyncio]

WRONG = "canary-that-is-wrong-5511"
NEW = "canary-of-a-new-one-8080"


async def lesson(port: int) -> list[str]:
    """Do everything that a secret is needed for; return the secrets."""
    connect = PendantClient.connect
    async with (
        await connect(port=port, user="ann", password=PASSWORDS["ann"]) as ann,
        await connect(port=port, user="otto", password=PASSWORDS["otto"], state_rate=50) as otto,
        await connect(port=port, client="guest") as guest,
    ):
        with pytest.raises(Refused):
            await guest.login("otto", password=WRONG)
        code = await ann.issue_pairing_code()
        await guest.login("Mia", pairing=code)
        await ann.add_account("nina", AccountRole.OPERATOR, NEW)
        async with await connect(port=port, user="nina", password=NEW):
            pass
        await ann.manage({"op": "users.remove", "name": "nina"})
        await otto.wait_until(lambda state: state.motion_possible == 1)
        async with otto.control():
            goal = [angle + 0.02 for angle in otto.joints()]
            await (await otto.move_joints(goal, speed=0.5)).done()
        await otto.stop("the lesson is over")
        with pytest.raises(Refused):
            await otto.manage({"op": "users.list"})
    return [*PASSWORDS.values(), WRONG, NEW, code, code.replace("-", "")]


def traces_of(secret: str, content: bytes) -> bool:
    return any(form in content for form in (secret.encode(), secret.encode().hex().encode()))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


async def test_promise_30_no_secret_is_in_anything_that_a_server_writes(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Journal, logs, audit log, store, and what the tools print of them."""
    caplog.set_level(logging.DEBUG)
    async with guarded_server(tmp_path) as server:
        secrets = await lesson(server.port)
        dump = repr(vars(server.app)) + repr(server.app.login.accounts)
    printed = io.StringIO()
    with redirect_stdout(printed), redirect_stderr(printed):
        assert await asyncio.to_thread(rerun, [str(server.journal), "--state"]) == 0
        assert audit_main(["verify", str(server.audit)]) == 0
        audit_main(["show", str(server.audit)])
    written = contents(tmp_path)
    written |= {"log": caplog.text.encode(), "tools": printed.getvalue().encode()}
    written["dump"] = dump.encode()
    found = {
        (name, number)
        for name, content in written.items()
        for number, secret in enumerate(secrets)
        if traces_of(secret, content)
    }
    assert found == set()
    assert len(written["journal"]) > 10_000


async def test_the_audit_log_tells_who_did_what(tmp_path: Path) -> None:
    async with guarded_server(tmp_path) as server:
        await lesson(server.port)
    entries = [json.loads(line) for line in server.audit.read_text().splitlines()]
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


async def test_promise_29_a_lock_is_told_at_once_and_a_stop_goes_through(tmp_path: Path) -> None:
    async with (
        guarded_server(tmp_path) as server,
        await PendantClient.connect(port=server.port) as pendant,
    ):
        codes, slowest = [], 0.0
        for _ in range(8):
            began = time.monotonic()
            with pytest.raises(Refused) as refused:
                await pendant.login("otto", password=WRONG)
            codes.append(refused.value.code)
            if refused.value.code == VerdictCode.LOCKED_OUT:
                slowest = max(slowest, time.monotonic() - began)
        assert codes == [VerdictCode.LOGIN_FAILED] * 5 + [VerdictCode.LOCKED_OUT] * 3
        assert slowest < 0.1
        await pendant.stop("locked out, and stopping")
        assert server.app.cells[0].core.cell.stop is not None


CODEC = codec_for(PENDANT, ByteOrder.LITTLE, 4)


def as_recorded(goal: tuple[float, ...]) -> list[Message]:
    """Return what an operator sends to take the authority, move, jog and reset."""
    joints = joint_array(goal)
    return [
        Authority(2, AuthorityAction.REQUEST),
        AuthorityBeat(),
        JointMove(3, 0.5, len(goal), joints),
        JogStart(4, 1, 1, 0.15, JogSpace.JOINTS, "", len(goal), joint_array([1.0] + [0.0] * 5)),
        JogBeat(1, 1),
        JogBeat(1, 2),
        SetSpeed(5, 1.0, 0.0),
        ResetStop(6),
    ]


async def test_promise_28_recorded_frames_do_nothing_on_another_connection(tmp_path: Path) -> None:
    """What an operator sends, pasted byte for byte on a second connection, is refused."""
    async with (
        guarded_server(tmp_path) as server,
        await PendantClient.connect(
            port=server.port, user="otto", password=PASSWORDS["otto"], state_rate=50
        ) as otto,
    ):
        await otto.wait_until(lambda state: state.motion_possible == 1)
        async with otto.control():
            before = otto.joints()
            frames = as_recorded(tuple(angle + 0.2 for angle in before))
            reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
            writer.write(CODEC.encode(Hello(PROTOCOL_VERSION, 0.0, "", "a thief")))
            for frame in frames:
                writer.write(CODEC.encode(frame))
            await asyncio.sleep(0.3)
            answers = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=65_532)
            for frame in (Hello(PROTOCOL_VERSION, 0.0, "", ""), *frames):
                answers.send(frame)
            codes = [
                answer.code
                for answer in answers.receive(await reader.read(65_536))
                if isinstance(answer, Verdict)
            ]
            assert codes == [VerdictCode.LOGIN_NEEDED] * 5
            holder = server.app.cells[0].core.cell.authority.holder
            assert holder is not None
            assert holder.client == "otto"
            assert (await otto.next_state()).positions[:6] == pytest.approx(before)
            writer.close()


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A certificate that signed itself, and its key."""
    if OPENSSL is None:
        pytest.skip("no openssl to make a certificate with")
    folder = tmp_path_factory.mktemp("tls")
    paths = folder / "server.pem", folder / "server.key"
    command = [
        *(OPENSSL, "req", "-x509", "-newkey", "ec", "-nodes", "-days", "2"),
        *("-pkeyopt", "ec_paramgen_curve:prime256v1", "-subj", "/CN=pendant server"),
        *("-addext", "subjectAltName=IP:127.0.0.1"),
        *("-keyout", str(paths[1]), "-out", str(paths[0])),
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    paths[1].chmod(0o600)
    return paths


async def test_the_pendant_port_speaks_tls_where_there_is_a_certificate(
    tmp_path: Path, certificate: tuple[Path, Path]
) -> None:
    tls = {"certificate": str(certificate[0]), "key": str(certificate[1])}
    trusted = ssl.create_default_context(cafile=str(certificate[0]))
    async with guarded_server(tmp_path, tls=tls) as server:
        async with await PendantClient.connect(
            port=server.port, tls=trusted, user="otto", password=PASSWORDS["otto"], state_rate=50
        ) as otto:
            await otto.wait_until(lambda state: state.motion_possible == 1)
            async with otto.control():
                goal = [angle + 0.02 for angle in otto.joints()]
                await (await otto.move_joints(goal, speed=0.5)).done()
        with pytest.raises((PendantError, OSError)):
            await PendantClient.connect(port=server.port, user="otto", password=PASSWORDS["otto"])


async def test_an_account_that_is_removed_beside_the_server_is_logged_out(tmp_path: Path) -> None:
    """By `openpendant users`, which writes the store's file while the server runs."""
    async with (
        guarded_server(tmp_path) as server,
        await PendantClient.connect(
            port=server.port, user="otto", password=PASSWORDS["otto"], state_rate=50
        ) as otto,
    ):
        await otto.take_control()
        lost = asyncio.Event()
        otto.on_authority = lambda _: lost.set()
        assert users_main(["remove", "otto", "--store", str(server.store)]) == 0
        async with asyncio.timeout(5):
            await lost.wait()
        assert server.app.cells[0].core.cell.authority.holder is None
        with pytest.raises(Refused) as refused:
            await otto.take_control()
        assert refused.value.code == VerdictCode.LOGIN_NEEDED
