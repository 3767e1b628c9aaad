"""The gateway's file: what may be said, and what is refused with a sentence."""

import os
from pathlib import Path
from typing import Any

import pytest

from openpendant.tools.pendants.settings_file import SettingsRefused, read_file
from openpendant.tools.pendants.web.settings import (
    IdentitySettings,
    read_secret,
    settings_of,
)

CELL = {"name": "cell", "address": "127.0.0.1:11010"}
SECRET = "0123456789abcdef" * 4


def refused(**data: object) -> str:
    with pytest.raises(SettingsRefused) as error:
        settings_of({"servers": [CELL], **data}, "web.toml")
    return str(error.value)


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "unknown key": ({"hots": "x"}, "hots: unknown key"),
    "no server": ({"servers": []}, "servers"),
    "no address": ({"servers": [{"name": "cell"}]}, "servers.0.address: must be given"),
    "wrong address": ({"servers": [{**CELL, "address": "x:0"}]}, "PORT 1 to 65535"),
    "one name twice": ({"servers": [CELL, CELL]}, "a name of its own"),
    "a long name": ({"servers": [{**CELL, "name": "x" * 33}]}, "1 to 32 bytes"),
    "a proxy by name": ({"proxies": ["localhost"]}, "the address of one host"),
    "proxies as a network": ({"proxies": ["10.0.0.0/8"]}, "the address of one host"),
    "an origin with a path": ({"origins": ["https://a.example/x"]}, "without a path"),
    "an origin without a scheme": ({"origins": ["a.example"]}, "such as https://"),
    "a port beyond": ({"port": 65_536}, "port"),
}


@pytest.mark.parametrize(("data", "why"), FAULTS.values(), ids=list(FAULTS))
def test_what_cannot_be_used_is_refused_by_its_key(data: dict[str, Any], why: str) -> None:
    assert why in refused(**data)


@pytest.mark.parametrize(
    "open_to_others", [{"host": "0.0.0.0"}, {"host": "192.0.2.1"}, {"proxies": ["127.0.0.1"]}]
)
def test_nobody_elsewhere_is_served_as_if_he_were_this_machine(
    open_to_others: dict[str, Any],
) -> None:
    assert "every browser would count as this machine" in refused(**open_to_others)
    settings_of({"servers": [CELL], "gateway": {"secret_file": "x"}, **open_to_others}, "web.toml")


def test_the_secret_does_not_cross_a_network_in_clear_text() -> None:
    far = {"name": "far", "address": "192.0.2.1"}
    gateway = {"secret_file": "x"}
    assert "the secret needs TLS" in refused(servers=[CELL, far], gateway=gateway)
    settings_of({"servers": [{**far, "ca": "far.pem"}], "gateway": gateway}, "web.toml")
    settings_of({"servers": [far]}, "web.toml")


@pytest.mark.parametrize(
    "content", [b"port = ", b"\xff", b"x" * 70_000], ids=["cut", "no text", "large"]
)
def test_a_file_that_is_no_toml_is_refused(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "web.toml"
    file.write_bytes(content)
    with pytest.raises(SettingsRefused, match=r"web\.toml"):
        read_file(file)


def test_only_a_file_is_read_and_nothing_is_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for name in ("pipe", "missing", "."):
        with pytest.raises(SettingsRefused):
            read_file(tmp_path / name)


def secret_file(folder: Path, content: str, mode: int = 0o600) -> IdentitySettings:
    file = folder / "secret"
    file.write_text(content)
    file.chmod(mode)
    return IdentitySettings(secret_file=str(file))


def test_a_secret_is_32_bytes_in_hexadecimal(tmp_path: Path) -> None:
    assert read_secret(secret_file(tmp_path, f"{SECRET}\n")) == SECRET
    for wrong in ("", SECRET[1:], SECRET + "0", SECRET[:-1] + "g"):
        with pytest.raises(SettingsRefused, match="openssl rand -hex 32"):
            read_secret(secret_file(tmp_path, wrong))


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660])
def test_a_secret_that_others_may_read_is_none(tmp_path: Path, mode: int) -> None:
    with pytest.raises(SettingsRefused, match="chmod 600"):
        read_secret(secret_file(tmp_path, SECRET, mode))
