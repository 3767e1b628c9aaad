"""Which cell is meant where a server has several: found by its name or by its robot's.

Owns the choice and the wording where there is none or more than one. Connects to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from openpendant.simplemsg.verdicts import VerdictCode

from .failures import Refused, WrongArgument
from .management.cell import ServedCell

_LISTED_AFTER = "; here: "


def some_cell(refused: Refused) -> str:
    """Return a cell that a server of several named when it refused a hello; empty for none.

    Any of them tells all the others, by `PendantClient.cells`.
    """
    if refused.code != VerdictCode.UNKNOWN_CELL:
        return ""
    return refused.text.partition(_LISTED_AFTER)[2].partition(", ")[0]


def chosen_cell(name: str, cells: Sequence[ServedCell]) -> str:
    """Return the cell of a name, or the only one whose robot has it.

    Args:
        name: of a cell or a robot; empty for the only cell.
        cells: all that are served.

    Raises:
        WrongArgument: there is none, or more than one; the text has the cells.
    """
    if name in [each["cell"] for each in cells]:
        return name
    found = [each["cell"] for each in cells if name in ("", each["robot"])]
    if len(found) == 1:
        return found[0]
    if found and name:
        raise WrongArgument(f"{len(found)} cells have a robot {name!r}: name {' or '.join(found)}")
    known = ", ".join(f"{each['robot']} (cell {each['cell']})" for each in cells)
    if found:
        raise WrongArgument(f"the server has several robots: name one of {known}")
    raise WrongArgument(f"no robot {name!r}; the server has {known}")
