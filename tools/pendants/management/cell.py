"""The cell as a whole: its snapshot, its neighbours, why it does not move, and the ways out."""

from __future__ import annotations

from typing import Literal, NotRequired, TypedDict

from ..snapshot import Snapshot
from ..way_out import Hold
from .calls import Request, asks, call

Wish = Literal["move", "jog", "program"]


class ServedCell(TypedDict):
    """One cell: its name, for `connect`, and the name of its robot.

    Attributes:
        cell: its name, for `connect`.
        robot: name of its robot.
    """

    cell: str
    robot: str


class ServedCells(TypedDict):
    """All cells behind the pendant port.

    Attributes:
        cells: in the order of the server's configuration.
    """

    cells: list[ServedCell]


class Condition(TypedDict):
    """One condition of a motion; the last five are empty where it holds.

    Attributes:
        condition: its name.
        meaning: what has to hold.
        holds: whether it does.
        code: entry of the catalogue.
        name: of that entry.
        text: one sentence with the numbers.
        cause: what happened.
        remedy: what to do about it.
    """

    condition: str
    meaning: str
    holds: bool
    code: int
    name: str
    text: str
    cause: str
    remedy: str


class End(TypedDict):
    """Why a motion ended before its goal.

    Attributes:
        code: entry of the catalogue.
        name: of that entry.
        text: one sentence with the numbers.
        cause: what happened.
        remedy: what to do about it.
    """

    code: int
    name: str
    text: str
    cause: str
    remedy: str


class Why(TypedDict):
    """The chain of conditions in the order in which they are examined.

    Attributes:
        cell: name of the cell.
        kind: what shall move it.
        ready: whether all hold.
        broken: the first that is broken; empty where all hold.
        conditions: all of them.
        ended: why the last motion ended before its goal; None where it arrived or another began.
        remarks: what else is to be known, such as that the robot moved without a command; empty
            from an older server, whose answer has none.
    """

    cell: str
    kind: Wish
    ready: bool
    broken: str
    conditions: list[Condition]
    ended: End | None
    remarks: NotRequired[list[str]]


class CellCalls:
    """The operations on the cell as a whole, which are the clients' own calls."""

    @call
    def snapshot(self) -> Request[Snapshot]:
        """Return the whole state of the cell: robot, limits, owner, stop, obstacle."""
        return asks("snapshot")

    @call
    def cells(self) -> Request[ServedCells]:
        """Return which cells and robots the server has behind this port."""
        return asks("cells")

    @call
    def why(
        self, *, kind: Wish = "move", whose: Literal["holder", "mine"] = "holder"
    ) -> Request[Why]:
        """Return what keeps the robot from moving: every condition, and the first broken one.

        Args:
            kind: what shall move it.
            whose: for whoever is in control, so that an onlooker may ask, or for this connection.
        """
        return asks("why", kind=kind, whose=whose)

    @call
    def retreat(self) -> Request[list[Hold]]:
        """Return at what limit, singularity or contact the robot stands, and what leads out.

        One entry for each; none where it stands free. Show `press`, or jog by `jog_out`.

        Raises:
            Refused: MOVING, FEEDBACK_STALE.
        """
        return Request("jog.retreat", {}, part="holds")
