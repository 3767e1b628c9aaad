import json
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]

TOY = '''
"""A declaration that somebody adds."""

from __future__ import annotations

from typing import Annotated, TypedDict

from openpendant.simplemsg.pendant.management.declaration import Count, Request, operation
from openpendant.simplemsg.pendant.roles import Permission


class Counted(TypedDict):
    """How many there are.

    Attributes:
        points: how many.
    """

    points: int


@operation("trace.count", needs=Permission.CHANGE_SCENE)
class CountTrace(Request[Counted]):
    """Count the points of the trace.

    Raises:
        Refused: FEEDBACK_STALE.
    """

    least: Annotated[int, Count(0)]
    """points to count at least."""
'''

USE = """
import json, sys
from pathlib import Path

import toy
from openpendant.server.access.request_gate import needs_of
from openpendant.server.events.management_requests import handles
from openpendant.server.scene.scene_service import SceneService

def count(self, asked, reply, now):
    return reply.answer({"points": max(asked.least, len(self._trace.points))})

SceneService.count = handles(toy.CountTrace)(count)

from rigs.cells.surrounded_cell import SurroundedCell
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.management.groups import TraceCalls
from openpendant.tools.reference.operations_page import operations_page
from openpendant.tools.reference.schemas import schema_files

cell = SurroundedCell(Path(sys.argv[1]))
code, text = cell.refused("trace.count", least=-1)
section = operations_page().partition("### trace.count\\n")[2].partition("\\n### ")[0]
print(json.dumps({
    "answer": cell.ask("trace.count", least=7),
    "refused": text,
    "needs": needs_of("trace.count"),
    "schema": json.loads(schema_files()["trace.count-request.json"])["properties"]["least"],
    "section": section,
    "awaited": PendantClient().trace.count.__doc__,
    "blocking": callable(TraceCalls.count.request),
}))
"""


def test_an_operation_is_added_by_a_declaration_and_a_handler(tmp_path: Path) -> None:
    (tmp_path / "toy.py").write_text(TOY, "utf-8")
    (tmp_path / "use.py").write_text(USE, "utf-8")
    ran = subprocess.run(
        [sys.executable, str(tmp_path / "use.py"), str(tmp_path)],
        env={"PYTHONPATH": f"{tmp_path}:{TESTS}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    told = json.loads(ran.stdout)
    assert told["answer"] == {"points": 7}
    assert told["refused"] == "trace.count.least: Input should be greater than or equal to 0"
    assert told["needs"] == "change-scene"
    assert told["schema"]["description"] == "points to count at least."
    assert "- Role: programmer (`change-scene`)." in told["section"]
    assert "- Client: `pendant.trace.count(least)`." in told["section"]
    assert "May be refused: [FEEDBACK_STALE]" in told["section"]
    assert told["awaited"].startswith("Count the points of the trace.")
    assert told["blocking"]
