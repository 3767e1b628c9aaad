from pathlib import Path

import pytest
from rigs.data.tshark_captures import require_tshark

from openpendant.tools.reference.dissector import lua_dissector


@pytest.fixture(name="script", scope="module")
def _script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    require_tshark()
    script = tmp_path_factory.mktemp("dissector") / "openpendant.lua"
    script.write_text(lua_dissector(), encoding="utf-8")
    return script
