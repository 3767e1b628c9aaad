import subprocess
import sys
from pathlib import Path

import pytest

from openpendant.tools.packets.cli import main
from openpendant.tools.reference.dissector import lua_dissector


def test_the_dissector_is_written_to_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dissector"]) == 0
    assert capsys.readouterr().out == lua_dissector()


def test_the_dissector_is_written_to_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["dissector", "-o", str(tmp_path / "openpendant.lua")]) == 0
    assert (tmp_path / "openpendant.lua").read_text(encoding="utf-8") == lua_dissector()
    assert capsys.readouterr().out == ""


def test_a_file_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["dissector", "-o", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert str(tmp_path) in line


def test_writing_it_loads_neither_server_nor_pydantic() -> None:
    script = (
        "import sys; from openpendant.tools.packets.dissector import main; main([]);"
        "sys.exit(bool({'pydantic', 'numpy', 'openpendant.server'} & set(sys.modules)))"
    )
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
    assert ran.returncode == 0, ran.stderr
