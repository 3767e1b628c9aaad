"""`[[gateways]]` of a configuration: what is refused at the start, and what is read of a secret."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from rigs.peers.tls_certificates import make_certificate

from openpendant.server.access.open_access import opened_access
from openpendant.server.settings.config_file import ConfigurationError
from openpendant.server.settings.server_settings import (
    make_server_settings,
    server_settings_as_toml,
)
from openpendant.server.shell.server_process import files_needed

HEX = "0123456789abcdef" * 4


def gateway(**changed: Any) -> dict[str, Any]:
    return {"name": "web", "address": "127.0.0.1", "secret_file": "gateway.secret", **changed}


def refusal(*gateways: Any) -> ConfigurationError:
    with pytest.raises(ConfigurationError) as caught:
        make_server_settings({"gateways": list(gateways)}, "room.toml")
    return caught.value


@pytest.mark.parametrize(
    "address",
    [
        *("127.0.0.0/8", "10.0.0.0/24", "localhost", "gate.school", "fe80::1%eth0", "::", ""),
        *("127.0.0.1:11010", "[::1]", "224.0.0.1", "0.0.0.0"),
    ],
)
def test_an_address_that_is_not_that_of_one_host_is_refused(address: str) -> None:
    told = refusal(gateway(address=address))
    assert told.key == "gateways.0.address"
    assert "not a network" in told.problem


@pytest.mark.parametrize("address", ["127.0.0.1", "::1", "2001:db8::1", "::ffff:127.0.0.1"])
def test_an_address_of_one_host_is_taken(address: str) -> None:
    make_server_settings({"gateways": [gateway(address=address)]}, "room.toml")


@pytest.mark.parametrize(
    ("changed", "key"),
    [
        ({"name": ""}, "gateways.0.name"),
        ({"name": "x" * 33}, "gateways.0.name"),
        ({"name": "esc\x1b"}, "gateways.0.name"),
        ({"secret_file": ""}, "gateways.0.secret_file"),
    ],
)
def test_what_no_gateway_can_be_called_is_refused(changed: dict[str, str], key: str) -> None:
    assert refusal(gateway(**changed)).key == key


def test_two_gateways_of_one_name_and_too_many_are_refused() -> None:
    assert "a name of its own" in refusal(gateway(), gateway()).problem
    assert refusal(*(gateway(name=f"web {number}") for number in range(17))).key == "gateways"


def test_an_unknown_key_is_refused_with_those_that_are_known() -> None:
    told = refusal(gateway(secret="here"))
    assert told.key == "gateways.0.secret"
    assert told.problem == "unknown key; known here: name, address, secret_file"


@pytest.mark.parametrize("cells", [{}, {"cells": [{"name": "left"}, {"name": "right"}]}])
def test_printed_settings_have_their_gateways(cells: dict[str, Any]) -> None:
    settings = make_server_settings(
        {"gateways": [gateway(), gateway(name="own", address="127.0.0.2")], **cells}, "room.toml"
    )
    printed = tomllib.loads(server_settings_as_toml(settings))
    assert [each["name"] for each in printed["gateways"]] == ["web", "own"]
    assert make_server_settings(printed, "printed") == settings


def test_descriptors_are_set_aside_for_those_that_have_said_nothing() -> None:
    none, one = (
        make_server_settings({"gateways": each}, "room.toml") for each in ([], [gateway()])
    )
    assert files_needed(one) - files_needed(none) == 64


# The secret.


def opened(folder: Path, content: bytes | None, mode: int = 0o600, **tables: Any) -> str:
    """Open the access of a server; return the secret of its gateway."""
    file = folder / "gateway.secret"
    if content is not None:
        file.write_bytes(content)
        file.chmod(mode)
    tables.setdefault("gateways", [gateway(secret_file=str(file))])
    about = {"store": {"path": str(folder / "store.db")}, **tables}
    with opened_access(make_server_settings(about, "room.toml"), "room.toml") as access:
        return access.gateway_secrets["web"].reveal()


@pytest.mark.parametrize(
    "content", [HEX.encode(), HEX.encode() + b"\n", b" " + HEX.upper().encode() + b"\r\n"]
)
def test_a_secret_is_32_bytes_in_hexadecimal(tmp_path: Path, content: bytes) -> None:
    assert opened(tmp_path, content).lower() == HEX


@pytest.mark.parametrize(
    ("content", "mode", "problem"),
    [
        (None, 0, "cannot be read: No such file"),
        (HEX.encode(), 0o640, "is open to other users of this machine (mode 640); chmod 600"),
        (HEX.encode(), 0o604, "chmod 600"),
        (HEX.encode(), 0o610, "chmod 600"),
        (b"", 0o600, "does not hold 32 bytes in hexadecimal"),
        (HEX[:-1].encode(), 0o600, "does not hold"),
        (HEX.encode() + b"0", 0o600, "does not hold"),
        (HEX[:-1].encode() + b"g", 0o600, "does not hold"),
        (b"\xff" * 64, 0o600, "does not hold"),
        (HEX.encode() + b"\n" * 4_096, 0o600, "does not hold"),
    ],
)
def test_another_file_is_refused_at_the_start(
    tmp_path: Path, content: bytes | None, mode: int, problem: str
) -> None:
    with pytest.raises(ConfigurationError) as caught:
        opened(tmp_path, content, mode)
    assert caught.value.key == "secret_file of gateway 'web'"
    assert problem in caught.value.problem
    assert HEX[:-1] not in str(caught.value)


def test_the_secret_of_a_gateway_elsewhere_needs_tls(tmp_path: Path) -> None:
    tables: dict[str, Any] = {
        "gateways": [
            gateway(address="192.0.2.5", secret_file=str(tmp_path / "gateway.secret")),
        ]
    }
    with pytest.raises(ConfigurationError) as caught:
        opened(tmp_path, HEX.encode(), **tables)
    assert caught.value.key == "address of gateway 'web'"
    assert "TLS" in caught.value.problem
    certificate, key = make_certificate(tmp_path)
    tables["tls"] = {"certificate": str(certificate), "key": str(key)}
    assert opened(tmp_path, HEX.encode(), **tables) == HEX


@pytest.mark.parametrize("address", ["127.0.0.2", "::1", "::ffff:127.0.0.1"])
def test_that_of_one_on_this_machine_does_not(tmp_path: Path, address: str) -> None:
    file = str(tmp_path / "gateway.secret")
    own = [gateway(address=address, secret_file=file)]
    assert opened(tmp_path, HEX.encode(), gateways=own) == HEX
