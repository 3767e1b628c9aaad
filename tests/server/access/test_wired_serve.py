"""`openpendant serve` and who may reach it: refused before it listens, with exit code 2."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rigs.peers.tls_certificates import make_certificate
from rigs.processes.bare_app import bare_app
from rigs.processes.guarded_server import add_accounts
from rigs.processes.judged_server import LoopPlanner

from openpendant.motion.description.robot import serial_robot
from openpendant.server.access.audit_file import AuditLog
from openpendant.server.access.open_access import opened_access
from openpendant.server.cli import serve
from openpendant.server.events.events import Port
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.settings.config_file import ConfigurationError
from openpendant.server.settings.server_settings import ServerSettings, make_server_settings
from openpendant.server.shell.cell_shell import CellParts
from openpendant.simplemsg.journal import Journal
from openpendant.tools.console import ExitCode
from openpendant.tools.packets.journals.reenactment import NullTransport

OUTSIDE = "192.0.2.7"


def refused(folder: Path, text: str, capsys: pytest.CaptureFixture[str]) -> str:
    file = folder / "cell.toml"
    file.write_text(text)
    assert (
        serve.main(["--config", str(file), "--store", str(folder / "store.db")]) == ExitCode.USAGE
    )
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (f'[listen]\nhost = "{OUTSIDE}"\n', "listen.host: 192.0.2.7 can be reached from outside"),
        ('[listen]\nhost = "0.0.0.0"\n', "add an account"),
        ('[ros_i]\nallow = ["0.0.0.0"]\n', "ros_i.allow: '0.0.0.0' is no address of one host"),
        ('[tls]\ncertificate = "no.pem"\nkey = "no.key"\n', "tls: no.pem: cannot be read"),
        (
            '[access]\naudit_log = "/no/folder/audit.jsonl"\n',
            "access.audit_log: /no/folder/audit.jsonl: ",
        ),
    ],
    ids=["outside", "everywhere", "ros", "certificate", "audit log"],
)
def test_a_server_that_would_be_open_is_refused_with_what_would_be_accepted(
    tmp_path: Path, text: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert told in refused(tmp_path, text, capsys)


def test_the_key_of_another_certificate_is_refused_without_a_traceback_or_the_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Promise 30 as well: what a key file holds is never repeated."""
    certificate, _ = make_certificate(tmp_path)
    _, key = make_certificate(tmp_path, "other")
    told = refused(tmp_path, f'[tls]\ncertificate = "{certificate}"\nkey = "{key}"\n', capsys)
    assert f"{key}: does not belong to the certificate in {certificate}" in told
    assert told.count("\n") == 1
    assert not any(line in told for line in key.read_text().splitlines())


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
def test_a_clear_text_port_that_others_reach_serves_only_named_addresses(
    address: str, is_served: bool
) -> None:
    values = {"listen": {"host": OUTSIDE}, "ros_i": {"allow": ["192.0.2.9"]}}
    settings = make_settings(values, "test")
    app = bare_app([CellParts(settings, serial_robot("ur5"), LoopPlanner())], Journal(lambda: 0))
    transport = Peer(address)
    app.connect(Port.ROS_STATE, 0).connection_made(transport)
    assert transport.is_aborted != is_served
