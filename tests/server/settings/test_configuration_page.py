from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from openpendant.server.settings.cell_settings import CellSettings

PAGE = Path(__file__).parents[3] / "docs" / "configuration.md"
DEFAULTS = CellSettings().model_dump(mode="json")


def documented() -> dict[str, object]:
    example = PAGE.read_text("utf-8").partition("```toml\n")[2].partition("```")[0]
    shown = tomllib.loads(example)
    del shown["emulator"]
    return shown


def test_no_table_and_no_key_is_unknown_or_left_out() -> None:
    shown = documented()
    assert shown.keys() == DEFAULTS.keys()
    for name, table in DEFAULTS.items():
        if isinstance(table, dict):
            assert isinstance(shown[name], dict)
            assert shown[name].keys() == table.keys(), name  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", DEFAULTS)
def test_each_key_is_shown_with_its_default(name: str) -> None:
    assert documented()[name] == DEFAULTS[name]
