"""`openpendant cells`: lists the cells of a server, without a hello or a login."""

from __future__ import annotations

import sys

from openpendant.simplemsg.pendant.management.cell import ServedCell

from ...console import ExitCode
from ..client import PendantClient
from ..credentials import tls_context
from .running import CommandOutput, parser, run_task


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    reader = parser(
        "cells",
        "List the cells of a server; anybody may. Who holds a cell is shown on the server's own"
        " machine.",
        logs_in=False,
        of_cell=False,
    )
    arguments = reader.parse_args(sys.argv[1:] if argv is None else argv)
    output = CommandOutput("cells", is_json=arguments.json)

    async def show() -> int:
        host, port = arguments.server
        told = await PendantClient.lobby(host, port, tls=tls_context(arguments.ca))
        for each in told["cells"]:
            output.say("cell", _in_words(each), **each)
        return ExitCode.OK

    return run_task(output, show)


def _in_words(cell: ServedCell) -> str:
    parts = [cell.get("display") or cell["robot"]]
    if cell.get("emulated"):
        parts.append("emulated")
    if cell.get("login_needed"):
        parts.append("login needed")
    if "holder" in cell:
        parts.append(f"held by {cell['holder']}" if cell["holder"] else "free")
    if cell.get("moving"):
        parts.append("moving")
    return f"{cell['cell']:<32}  {', '.join(parts)}"


if __name__ == "__main__":
    sys.exit(main())
