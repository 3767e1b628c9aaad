"""The page's packet inspector says of every frame what `openpendant packets decode` prints."""

import io
import json
import sys
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.node_tests import run_node_test

from openpendant.tools.packets.decode import main

VECTORS = Path(__file__).parents[4] / "docs" / "generated" / "vectors"
FORMS = [("le", 4), ("be", 4), ("le", 8), ("be", 8)]


def _printed(hexes: list[str], order: str, real: int, monkeypatch: pytest.MonkeyPatch) -> str:
    options = ["--format", "tree", "--color", "never", "--dialect", "pendant"]
    form = ["--real", str(real), "--order", {"le": "little", "be": "big"}[order]]
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO("\n".join(hexes).encode())))
    out = io.StringIO()
    monkeypatch.setattr(sys, "stdout", out)
    assert main([*options, *form]) == 0
    monkeypatch.undo()
    return out.getvalue()


def _texts(printed: str) -> list[str]:
    """Return the text of each frame: its title, then rows that are indented."""
    texts: list[list[str]] = []
    for line in printed.splitlines():
        if line.startswith(" "):
            texts[-1].append(line)
        else:
            texts.append([line])
    return ["\n".join(each) for each in texts]


def test_every_frame_reads_as_the_command_prints_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cases: list[dict[str, Any]] = []
    for order, real in FORMS:
        file = VECTORS / f"pendant-{order}-f{8 * real}.json"
        hexes = [vector["hex"] for vector in json.loads(file.read_text("utf-8"))]
        texts = _texts(_printed(hexes, order, real, monkeypatch))
        assert len(texts) == len(hexes)
        cases += [
            {"hex": one, "real": real, "text": text} for one, text in zip(hexes, texts, strict=True)
        ]
    path = tmp_path / "cases.json"
    path.write_text(json.dumps(cases), "utf-8")
    run_node_test("packets", PACKET_CASES=str(path))
