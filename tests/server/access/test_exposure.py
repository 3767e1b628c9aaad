"""What a server may be exposed to (promise 28): refused before it listens, with exit code 2."""

from pathlib import Path
from typing import Any

import pytest
from rigs.cells.admission_desk import BOOK, account
from rigs.processes.bare_app import bare_app
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
)
from openpendant.server.access.open_access import opened_access
from openpendant.server.cli import serve
from openpendant.server.events.events import Port
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.settings.config_file import ConfigurationError
from openpendant.server.settings.server_settings import ServerSettings, make_server_settings
from openpendant.server.shell.cell_shell import CellParts
from openpendant.simplemsg.journal import Journal
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
        (warning,) = access.warnings
        assert "clear text" in warning
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
    values = {"listen": {"host": OUTSIDE}, "ros_i": {"allow": ["192.0.2.9"]}}
    settings = make_settings(values, "test")
    app = bare_app([CellParts(settings, serial_robot("ur5"), LoopPlanner())], Journal(lambda: 0))
    transport = Peer(address)
    app.connect(Port.ROS_STATE, 0).connection_made(transport)
    assert transport.is_aborted != is_served
