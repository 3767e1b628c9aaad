"""Every file that a user names is read up to a bound, and is neither a device nor a pipe."""

import os
import resource
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from openpendant.controller_emulator.shell import settings as emulator
from openpendant.controller_emulator.shell.scenario import load_scenario
from openpendant.motion.description.robot import load_robot
from openpendant.motion.errors import RobotFileError
from openpendant.server.access.open_access import TlsUnusable, server_context
from openpendant.server.settings import config_file as server
from openpendant.server.settings.cell_settings import TlsSettings
from openpendant.tools.packets.console import PacketToolError
from openpendant.tools.packets.faulty.fault_script import load_script

MORE = 1 << 30


def _server_with_certificate(file: Path) -> object:
    return server_context(TlsSettings(certificate=str(file), key=str(file)))


Loaders = dict[str, tuple[Callable[[Path], object], type[Exception]]]

OF_TOML: Loaders = {
    "faults": (load_script, PacketToolError),
    "serve --config": (server.load_settings, server.ConfigurationError),
    "emulate --config": (emulator.load_settings, emulator.EmulatorSettingsError),
    "emulate --scenario": (load_scenario, emulator.EmulatorSettingsError),
}
LOADERS: Loaders = {
    **OF_TOML,
    "serve --robot": (load_robot, RobotFileError),
    "serve with TLS": (_server_with_certificate, TlsUnusable),
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
def test_a_huge_file_is_refused_in_one_line_with_its_bound(who: str, tmp_path: Path) -> None:
    load, error = LOADERS[who]
    huge = tmp_path / "huge"
    huge.touch()
    os.truncate(huge, 2 * MORE)
    with pytest.raises(error) as refusal:
        load(huge)
    told = str(refusal.value)
    assert told.startswith(f"{huge}: ")
    assert "1048576 bytes" in told
    assert len(told) < 150 + len(str(huge))


@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("who", LOADERS)
def test_what_may_have_no_end_is_refused_without_waiting(
    who: str, kind: str, tmp_path: Path
) -> None:
    load, error = LOADERS[who]
    file = tmp_path / kind
    if kind == "pipe":
        os.mkfifo(file)  # nobody writes to it: opening it the usual way would never end
    else:
        file.symlink_to("/dev/zero")
    with pytest.raises(error, match="is not a regular file; accepted: a file on a disk") as refusal:
        load(file)
    assert str(refusal.value).startswith(f"{file}: ")


@pytest.mark.parametrize("who", OF_TOML)
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
