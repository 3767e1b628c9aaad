"""Which cells and robots one server serves, for a pendant that has to choose."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, Self

from .management_bodies import Body


class CellsRequest(Body):
    """Asks for the cells of the server; the hello of another connection names one of them."""

    op: Literal["cells"]


class ServedCell(Body):
    """One cell: its name, for a hello, and the name of its robot."""

    cell: str
    robot: str


class ServedCells(Body):
    """All cells behind the pendant port that was asked."""

    cells: tuple[ServedCell, ...]

    @classmethod
    def of(cls, names: Iterable[tuple[str, str]]) -> Self:
        """Return cells from pairs of their names and their robots' names."""
        return cls(cells=tuple(ServedCell(cell=cell, robot=robot) for cell, robot in names))
