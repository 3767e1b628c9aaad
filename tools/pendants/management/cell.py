"""The cell as a whole: its snapshot, its neighbours, why it does not move, and the ways out."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import cell

from .calls import call


class CellCalls:
    """The operations on the cell as a whole, which are the clients' own calls."""

    snapshot = call(cell.SnapshotRequest)
    cells = call(cell.CellsRequest)
    why = call(cell.WhyRequest)
    retreat: call[[], list[cell.Hold]] = call(cell.RetreatRequest, part="holds")
