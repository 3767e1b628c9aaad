"""What a server may be exposed to (promise 28), refused before it listens; and TLS."""

import json
import shutil
import socket
import ssl
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from pydantic import ValidationError
from rigs.cells.admission_desk import BOOK, account
from rigs.cells.expectations import known
from rigs.peers.tls_certificates import make_certificate
from rigs.processes.bare_app import NoAccess, bare_app
from rigs.processes.guarded_server import add_accounts
from rigs.processes.judged_server import LoopPlanner

from openpendant.motion.description.robot import serial_robot
from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.audit_file import AuditLog
from openpendant.server.access.exposure import (
    Exposure,
    ExposureRefused,
    check_exposure,
    clear_text_fault,
    is_loopback,
    served_ports,
)
from openpendant.server.access.open_access import TlsUnusable, opened_access, server_context
from openpendant.server.cli import serve
from openpendant.server.events.events import Port
from openpendant.server.settings import cell_settings
from openpendant.server.settings.cell_settings import (
    CellSettings,
    TlsSettings,
    make_settings,
    settings_as_data,
)
from openpendant.server.settings.config_file import ConfigurationError, settings_as_toml
from openpendant.server.settings.server_settings import ServerSettings, make_server_settings
from openpendant.server.shell.app import App
from openpendant.server.shell.cell_shell import CellParts
from openpendant.server.shell.inbox import loop_time
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.console import ExitCode
from openpendant.tools.packets.journals.reenactment import NullTransport

Capture = pytest.CaptureFixture[str]

LAN = "192.0.2.5"
OWN = ["127.0.0.1", "127.8.8.8", "::1", "localhost", "::ffff:127.0.0.1"]


@pytest.mark.parametrize(
    "host", [*OWN, "0.0.0.0", "::", LAN, "", "localhost.example", "fe80::1%eth0"]
)
def test_this_machines_own_addresses_are_told_from_others(host: str) -> None:
    assert is_loopback(host) == (host in OWN)


def test_loopback_needs_neither_accounts_nor_tls() -> None:
    assert check_exposure(Exposure("127.0.0.1", False, ["127.0.0.1"]), AccountBook()) == []


@pytest.mark.parametrize("host", ["0.0.0.0", "::", LAN, "robot.example"])
@pytest.mark.parametrize(
    "book",
    [
        AccountBook(),
        AccountBook([account("otto", Role.OPERATOR)]),
        AccountBook([account("gone", Role.ADMIN, disabled=True)]),
    ],
    ids=["empty", "no admin", "disabled admin"],
)
def test_an_outer_address_is_refused_while_nobody_could_log_in(
    host: str, book: AccountBook
) -> None:
    with pytest.raises(ExposureRefused, match="openpendant users add") as caught:
        check_exposure(Exposure(host, True, []), book)
    assert caught.value.key == "listen.host"


@pytest.mark.parametrize(("has_tls", "warnings"), [(True, 0), (False, 1)])
def test_passwords_in_clear_text_are_warned_of(has_tls: bool, warnings: int) -> None:
    assert len(check_exposure(Exposure(LAN, has_tls, []), BOOK)) == warnings


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "*", "10.0.0.0/8", "", "224.0.0.1", "host"])
def test_a_list_for_the_clear_text_ports_that_names_no_host_is_refused(address: str) -> None:
    with pytest.raises(ExposureRefused) as caught:
        check_exposure(Exposure("127.0.0.1", False, ["127.0.0.1", address]), BOOK)
    assert caught.value.key == "ros_i.allow"


@pytest.mark.parametrize(
    ("host", "address", "is_taken"),
    [
        ("127.0.0.1", "127.0.0.1", True),
        (LAN, "192.0.2.7", True),
        (LAN, "::ffff:192.0.2.7", True),
        (LAN, "192.0.2.8", False),
        (LAN, "127.0.0.1", False),
        (LAN, "", False),
    ],
)
def test_clear_text_ports_serve_loopback_or_the_list(
    host: str, address: str, is_taken: bool
) -> None:
    fault = clear_text_fault(Exposure(host, False, ["192.0.2.7"]), address)
    assert (fault is None) is is_taken
    assert fault is None or fault.code is V.ADDRESS_NOT_ALLOWED


OUTSIDE = "192.0.2.7"


def refusal_of(folder: Path, text: str, capsys: Capture) -> str:
    file, store = folder / "cell.toml", folder / "store.db"
    file.write_text(text)
    assert serve.main(["--config", str(file), "--store", str(store)]) == ExitCode.USAGE
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f'[listen]\nhost = "{OUTSIDE}"\n', "listen.host: 192.0.2.7 can be reached from outside"),
        ('[listen]\nhost = "0.0.0.0"\n', "add an account"),
        ('[ros_i]\nallow = ["0.0.0.0"]\n', "ros_i.allow: '0.0.0.0' is no address of one host"),
        ('[tls]\ncertificate = "no.pem"\nkey = "no.key"\n', "tls: no.pem: cannot be read"),
        ('[access]\naudit_log = "/no/a.jsonl"\n', "access.audit_log: /no/a.jsonl: "),
    ],
    ids=["outside", "everywhere", "ros", "certificate", "audit log"],
)
def test_a_server_that_would_be_open_is_refused_with_what_would_be_accepted(
    tmp_path: Path, text: str, told: str, capsys: Capture
) -> None:
    said = refusal_of(tmp_path, text, capsys)
    assert told in said
    assert said.count("\n") == 1


def settings_of(folder: Path, **tables: Any) -> ServerSettings:
    return make_server_settings({"store": {"path": str(folder / "store.db")}, **tables}, "test")


def test_without_tls_a_server_that_others_reach_warns_of_clear_text(tmp_path: Path) -> None:
    add_accounts(tmp_path / "store.db")
    settings = settings_of(tmp_path, listen={"host": OUTSIDE})
    with opened_access(settings, "test") as access:
        in_clear_text, _ = access.warnings
        assert "clear text" in in_clear_text
        assert access.backend.book.find("ann") is not None


@pytest.mark.parametrize("content", [b"SQLite format 3\0" + b"rubbish" * 999, b""])
def test_a_broken_store_makes_nobody_the_single_user(tmp_path: Path, content: bytes) -> None:
    """Nor an empty file, such as a copy that was cut short and put back."""
    (tmp_path / "store.db").write_bytes(content)
    with opened_access(settings_of(tmp_path), "test") as access:
        assert not access.backend.single_user


def test_two_servers_do_not_write_one_audit_log(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "audit.jsonl")
    table = {"audit_log": str(tmp_path / "audit.jsonl")}
    with (
        pytest.raises(ConfigurationError, match=r"audit\.jsonl"),
        opened_access(settings_of(tmp_path, access=table), "test"),
    ):
        pass
    log.close()


class Peer(NullTransport):
    is_aborted = False

    def abort(self) -> None:
        self.is_aborted = True


@pytest.mark.parametrize(("address", "is_served"), [("192.0.2.9", True), ("192.0.2.10", False)])
def test_a_clear_text_port_outside_serves_only_named_addresses(
    address: str, is_served: bool
) -> None:
    listen = {"host": OUTSIDE, "ros_state_port": 11002}
    app, _ = served_cell(listen=listen, ros_i={"allow": ["192.0.2.9"]}, clock=lambda: 0)
    transport = Peer(address)
    app.connect(Port.ROS_STATE, 0).connection_made(transport)
    assert transport.is_aborted != is_served


# ROS-Industrial ports beside accounts.


def served_cell(
    access: NoAccess | None = None, clock: Callable[[], int] = loop_time, **tables: Any
) -> tuple[App, CellSettings]:
    settings = make_settings(tables, "test")
    parts = [CellParts(settings, serial_robot("ur5"), LoopPlanner())]
    return bare_app(parts, access=access, clock=clock), settings


ASKED = {"ros_motion_port": 11000, "ros_state_port": 0}


@pytest.mark.parametrize(
    ("listen", "beside_accounts"),
    [
        ({}, (None, None)),
        ({"ros_motion_port": "unless accounts"}, (None, None)),
        (ASKED, (11000, 0)),
        ({"ros_motion_port": 11000}, (11000, None)),
        ({"ros_motion_port": "off", "ros_state_port": 11002}, (None, 11002)),
    ],
)
def test_ros_ports_are_served_beside_accounts_where_they_are_named(
    listen: dict[str, object], beside_accounts: tuple[int | None, int | None]
) -> None:
    given = make_settings({"listen": listen}, "test").listen
    assert served_ports(given, is_guarded=True) == beside_accounts
    without = served_ports(given, is_guarded=False)
    assert without == (given.ros_motion_port, given.ros_state_port)


@pytest.mark.parametrize("listen", [{}, ASKED, {"ros_state_port": "off"}])
def test_whether_ports_were_asked_for_survives_printing_and_a_journal(
    listen: dict[str, object],
) -> None:
    settings = make_settings({"listen": listen}, "test")
    beside = served_ports(settings.listen, is_guarded=True)
    printed = make_settings(tomllib.loads(settings_as_toml(settings)), "printed")
    noted = CellSettings.model_validate(json.loads(json.dumps(settings_as_data(settings))))
    for again in (printed, noted):
        assert served_ports(again.listen, is_guarded=True) == beside
        assert again == settings


def test_of_several_cells_one_serves_beside_accounts_what_it_names() -> None:
    cells = [{"name": "left", "listen": ASKED}, {"name": "right"}]
    left, right = make_server_settings({"cells": cells}, "test").cells
    assert served_ports(left.listen, is_guarded=True) == (11000, 0)
    assert served_ports(right.listen, is_guarded=False) == (None, None)


@pytest.mark.parametrize(
    ("listen", "said"),
    [
        ({}, ["ros_motion_port and ros_state_port of cell 'cell': off"]),
        (ASKED, ["moves the robot past the accounts", "sees the robot and may stop it"]),
        ({"ros_motion_port": "off", "ros_state_port": "off"}, []),
    ],
    ids=["unasked", "asked", "off"],
)
def test_a_server_with_accounts_says_at_start_what_becomes_of_the_ros_ports(
    tmp_path: Path, listen: dict[str, object], said: list[str]
) -> None:
    without = settings_of(tmp_path, listen=listen)
    with opened_access(without, "test") as access:
        assert access.warnings == ()
    add_accounts(tmp_path / "store.db")
    with opened_access(settings_of(tmp_path, listen=listen), "test") as access:
        assert len(access.warnings) == len(said)
        for warning, text in zip(access.warnings, said, strict=True):
            assert text in warning
            assert "know" in warning


def test_a_store_that_cannot_be_read_counts_as_one_with_accounts(tmp_path: Path) -> None:
    (tmp_path / "store.db").write_bytes(b"SQLite format 3\0" + b"rubbish" * 999)
    with opened_access(settings_of(tmp_path), "test") as access:
        assert any("off, because this server wants a login" in each for each in access.warnings)


def is_listened_on(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.virtual_clock
async def test_the_first_account_closes_ports_and_connections_that_nobody_asked_for(
    caplog: pytest.LogCaptureFixture,
) -> None:
    access = NoAccess()
    usual = {key: cell_settings.UnaskedPort(0) for key in ("ros_motion_port", "ros_state_port")}
    app, settings = served_cell(access, listen={"pendant_port": 0})
    listen = settings.listen.model_copy(update=usual)
    app._settings[0] = settings.model_copy(update={"listen": listen})
    async with app.running() as ports:
        ros = ports.ros["cell"]
        moving, looking, pendant = Peer(), Peer(), Peer()
        app.connect(Port.ROS_MOTION, 0).connection_made(moving)
        app.connect(Port.ROS_STATE, 0).connection_made(looking)
        app.connect(Port.PENDANT, None).connection_made(pendant)
        bound = [known(ros.motion), known(ros.state), ports.pendant]
        assert [is_listened_on(port) for port in bound] == [True] * 3
        app.take_accounts()
        assert [each.is_aborted for each in (moving, looking)] == [False, False]
        access.book = BOOK
        app.take_accounts()
        assert [is_listened_on(port) for port in bound] == [False, False, True]
        assert [each.is_aborted for each in (moving, looking, pendant)] == [True, True, False]
        late = Peer()
        app.connect(Port.ROS_MOTION, 0).connection_made(late)
        assert late.is_aborted
        # Who removes the last account has its ports again with the next start.
        access.book = AccountBook()
        app.take_accounts()
        assert [is_listened_on(port) for port in bound] == [False, False, True]
    assert caplog.text.count("the ROS-Industrial ports") == 1


@pytest.mark.virtual_clock
async def test_ports_that_were_asked_for_stay_open_when_accounts_come() -> None:
    access = NoAccess()
    ports_asked = {"pendant_port": 0, "ros_motion_port": 0, "ros_state_port": 0}
    app, _ = served_cell(access, listen=ports_asked)
    async with app.running() as ports:
        moving = Peer()
        app.connect(Port.ROS_MOTION, 0).connection_made(moving)
        access.book = BOOK
        app.take_accounts()
        ros = ports.ros["cell"]
        assert is_listened_on(known(ros.motion))
        assert is_listened_on(known(ros.state))
        assert not moving.is_aborted


@pytest.mark.virtual_clock
async def test_where_accounts_exist_at_start_ports_that_nobody_asked_for_are_not_opened() -> None:
    access = NoAccess()
    access.book = BOOK
    app, _ = served_cell(access, listen={"pendant_port": 0})
    async with app.running() as ports:
        assert (ports.ros["cell"].motion, ports.ros["cell"].state) == (None, None)


class Pair(NamedTuple):
    certificate: Path
    key: Path

    def settings(self, ca: Path | None = None) -> TlsSettings:
        return TlsSettings(
            certificate=str(self.certificate), key=str(self.key), ca="" if ca is None else str(ca)
        )


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Pair, Pair]:
    folder = tmp_path_factory.mktemp("tls")
    return Pair(*make_certificate(folder)), Pair(*make_certificate(folder, "client"))


class End:
    def __init__(self, context: ssl.SSLContext, *, is_server: bool) -> None:
        self.incoming, self.outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        name = None if is_server else "127.0.0.1"
        self.tls = context.wrap_bio(self.incoming, self.outgoing, is_server, server_hostname=name)

    def shake(self) -> bool:
        try:
            self.tls.do_handshake()
        except ssl.SSLWantReadError:
            return False
        return True

    def encrypted(self, data: bytes) -> bytes:
        self.tls.write(data)
        return self.outgoing.read()

    def take(self, record: bytes) -> bytes:
        self.incoming.write(record)
        return self.tls.read()


def connect(server: ssl.SSLContext, client: ssl.SSLContext) -> tuple[End, End]:
    ends = End(server, is_server=True), End(client, is_server=False)
    done = [False, False]
    for _ in range(6):
        for index in (1, 0):
            done[index] = done[index] or ends[index].shake()
            ends[1 - index].incoming.write(ends[index].outgoing.read())
    assert all(done)
    return ends


def client_context(trusted: Pair, own: Pair | None = None) -> ssl.SSLContext:
    context = ssl.create_default_context(cafile=str(trusted.certificate))
    if own is not None:
        context.load_cert_chain(own.certificate, own.key)
    return context


def context_of(settings: TlsSettings) -> ssl.SSLContext:
    return known(server_context(settings))


def test_without_a_certificate_there_is_no_tls() -> None:
    assert server_context(TlsSettings()) is None


@pytest.mark.parametrize("given", [{"certificate": "a"}, {"key": "a"}, {"ca": "a"}])
def test_half_of_the_settings_are_refused(given: dict[str, str]) -> None:
    with pytest.raises(ValidationError):
        TlsSettings.model_validate(given)


def test_a_client_is_served_by_tls_1_3(pairs: tuple[Pair, Pair]) -> None:
    own, _ = pairs
    server, client = connect(context_of(own.settings()), client_context(own))
    assert client.tls.version() == "TLSv1.3"
    assert server.take(client.encrypted(b"hello")) == b"hello"


def test_an_older_version_is_refused(pairs: tuple[Pair, Pair]) -> None:
    own, _ = pairs
    old = client_context(own)
    old.maximum_version = ssl.TLSVersion.TLSv1_2
    with pytest.raises(ssl.SSLError):
        connect(context_of(own.settings()), old)


def test_with_a_ca_only_clients_with_its_certificate_are_served(pairs: tuple[Pair, Pair]) -> None:
    own, other = pairs
    context = context_of(own.settings(ca=other.certificate))
    server, client = connect(context, client_context(own, other))
    assert server.take(client.encrypted(b"hello")) == b"hello"
    with pytest.raises(ssl.SSLError):
        connect(context, client_context(own))


@pytest.mark.parametrize(
    "attack",
    [
        lambda first, second, other: [first, first],
        lambda first, second, other: [second, first],
        lambda first, second, other: [first, other],
        lambda first, second, other: [first, second[:-1] + bytes([second[-1] ^ 1])],
    ],
    ids=["replayed", "reordered", "from another connection", "bit flipped"],
)
def test_no_record_is_taken_twice_out_of_order_altered_or_from_elsewhere(
    pairs: tuple[Pair, Pair], attack: Callable[[bytes, bytes, bytes], list[bytes]]
) -> None:
    """Promise 28: no such command reaches the server, and the connection ends."""
    own, _ = pairs
    context = context_of(own.settings())
    server, client = connect(context, client_context(own))
    _, elsewhere = connect(context, client_context(own))
    first, second = client.encrypted(b"press 1"), client.encrypted(b"press 2")
    taken: list[bytes] = []
    with pytest.raises(ssl.SSLError):
        taken.extend(map(server.take, attack(first, second, elsewhere.encrypted(b"press 3"))))
    assert taken in ([], [b"press 1"])


def test_every_file_that_cannot_be_used_is_named(pairs: tuple[Pair, Pair], tmp_path: Path) -> None:
    own, other = pairs
    empty, open_key, damaged = tmp_path / "empty", tmp_path / "open", tmp_path / "damaged"
    empty.write_bytes(b"")
    empty.chmod(0o600)
    shutil.copy(own.key, open_key)
    open_key.chmod(0o644)
    damaged.write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    locked = Pair(*make_certificate(tmp_path, "locked", "-passout", "pass:secret"))
    cases = [
        (Pair(tmp_path / "nowhere", own.key), None, "nowhere", "cannot be read: No such file"),
        (Pair(own.certificate, tmp_path), None, tmp_path.name, "cannot be read: Is a directory"),
        (Pair(empty, own.key), None, "empty", "holds no certificate in PEM form"),
        (Pair(own.certificate, empty), None, "empty", "holds no private key in PEM form"),
        (Pair(damaged, own.key), None, "damaged", "is damaged"),
        (Pair(own.certificate, other.key), None, "client.key", "does not belong"),
        (Pair(own.certificate, locked.key), None, "locked.key", "is encrypted"),
        (Pair(own.certificate, open_key), None, "open", "mode 644"),
        (own, damaged, "damaged", "is damaged"),
        (own, empty, "empty", "holds no certificate"),
    ]
    keys = "".join(each.key.read_text() for each in (own, other, locked))
    for pair, ca, file, problem in cases:
        with pytest.raises(TlsUnusable) as caught:
            server_context(pair.settings(ca))
        assert Path(caught.value.file).name == file
        assert problem in caught.value.problem
        # Promise 30: what a key file holds is never repeated.
        assert not any(line in str(caught.value) for line in keys.splitlines())
