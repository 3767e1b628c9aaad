"""Every file that a user names is read up to a bound: a device or a pipe may have no end."""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from openpendant.controller_emulator import settings as emulator
from openpendant.controller_emulator.scenario import load_scenario
from openpendant.server import configuration_file as server
from openpendant.tools.packets.console import PacketToolError
from openpendant.tools.packets.faulty.fault_script import load_script

ENDLESS = Path("/dev/zero")
MORE = 1 << 30

LOADERS: dict[str, tuple[Callable[[Path], object], type[Exception]]] = {
    "faults": (load_script, PacketToolError),
    "serve --config": (server.load_settings, server.ConfigurationError),
    "emulate --config": (emulator.load_settings, emulator.ConfigurationError),
    "emulate --scenario": (load_scenario, emulator.ConfigurationError),
}


@pytest.fixture
def bounded_memory() -> Iterator[None]:
    """Let a loader that reads without end fail instead of taking the machine's memory."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MORE, hard))
    yield
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@pytest.mark.usefixtures("bounded_memory")
@pytest.mark.parametrize("who", LOADERS)
def test_an_endless_file_is_refused_in_one_line_with_its_bound(who: str) -> None:
    load, error = LOADERS[who]
    with pytest.raises(error) as refusal:
        load(ENDLESS)
    told = str(refusal.value)
    assert told.startswith(f"{ENDLESS}: ")
    assert "1048576 bytes" in told
    assert len(told) < 150


@pytest.mark.parametrize("who", LOADERS)
@pytest.mark.parametrize(
    "text", ["a = " + "[" * 20_000, "a = " + "1" * 5_000], ids=["deep", "long"]
)
def test_what_the_toml_parser_gives_up_on_is_refused_too(
    who: str, text: str, tmp_path: Path
) -> None:
    load, error = LOADERS[who]
    file = tmp_path / "file"
    file.write_text(text)
    with pytest.raises(error, match="TOML"):
        load(file)
