"""The planted faults of servers, as `server_faults.toml` lists them."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from rigs.faults import faulty_servers, motion_faults, subtle_faults, wire_faults
from rigs.faults.faulty_servers import Fault
from rigs.processes.judged_server import USUAL_RATE

from openpendant.tools.packets.conformance.check import CheckVerdict, Profile

_MODULES = (wire_faults, motion_faults, subtle_faults)
_REACHES_IN = {"bytes_in", "message_in", "frame_out", "state_out", "controller", "link", "service"}


def _fault(row: Mapping[str, Any], module: ModuleType) -> Fault:
    given = dict(row)
    given.pop("reason", None)
    given["found_by"] = tuple(given["found_by"])
    if "verdict" in given:
        given["verdict"] = CheckVerdict(given["verdict"])
    if "profile" in given:
        given["profile"] = Profile(given["profile"])
    # For what half the reports of an emulator do not show.
    if given.pop("at_usual_rate", False):
        given["settings"] = {"rate": USUAL_RATE}
    for where in _REACHES_IN & given.keys():
        given[where] = _named(given[where], module)
    return Fault(**given)


def _named(what: str | Mapping[str, Any], module: ModuleType) -> Any:
    """Return what has a name in a module, or what comes of a call of it with arguments."""
    names = vars(faulty_servers) | vars(module)
    if isinstance(what, str):
        return names[what]
    ((name, arguments),) = what.items()
    called = names[name]
    return called(**arguments) if isinstance(arguments, dict) else called(*arguments)


_TABLES = tomllib.loads((Path(__file__).parent / "server_faults.toml").read_text("utf-8"))
_ROWS = [
    (section, row, _fault(row, module))
    for module in _MODULES
    for section, rows in _TABLES[module.__name__.rpartition(".")[2]].items()
    for row in rows
]

SERVER_FAULTS = [fault for section, _, fault in _ROWS if section != "unfound"]

UNFOUND = [(fault, row["reason"]) for section, row, fault in _ROWS if section == "unfound"]
"""Faults that no check finds, with the reason."""
