"""`openpendant packets`: one table of tools, each imported only when it is called."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping

from ..console import ExitCode, complain

TOOLS: Mapping[str, tuple[str, str]] = {
    "decode": (".decode", "read packets (hexadecimal, pcap, captures), print what they say"),
    "encode": (".encode", "read JSON objects as decode prints them, print hexadecimal"),
    "show": (".show", "list the packets of a trace; filter, follow one request"),
    "record": (".record", "stand between client and server and write every frame to a file"),
    "replay": (".replay", "play one side of a trace against a real peer"),
    "faults": (".faults", "stand between client and server and break the traffic by a script"),
    "send": (".send", "send one packet, wait, print the reply"),
    "conformance": (".conformance.cli", "judge a simple-message server or client, check by check"),
    "rerun": (".rerun", "execute a journal again, byte for byte, on a virtual clock"),
    "dissector": (".dissector", "write the Wireshark dissector"),
}
"""Name of each tool: the module whose `main(argv: list[str]) -> int` runs it, and what it does."""


def main(argv: list[str] | None = None) -> int:
    """Run the command and return the tool's exit code; 2 for an unknown tool."""
    arguments = sys.argv[1:] if argv is None else argv
    match arguments:
        case ["-h" | "--help", *_]:
            print(_help())
            return ExitCode.OK
        case [name, *rest] if name in TOOLS:
            module = importlib.import_module(TOOLS[name][0], __package__)
            run: Callable[[list[str]], int] = module.main
            return run(rest)
        case []:
            print(_help(), file=sys.stderr)
        case [name, *_]:
            complain(f"openpendant packets: unknown tool {name!r}; known: {', '.join(TOOLS)}")
    return ExitCode.USAGE


def _help() -> str:
    width = max(map(len, TOOLS))
    return "\n".join(
        [
            "usage: openpendant packets [--help] TOOL ...",
            "",
            "Simple-message packets: shown, recorded, replayed, broken and judged.",
            "",
            "tools:",
            *(f"  {name:<{width}}  {about}" for name, (_, about) in TOOLS.items()),
            "",
            "Exit codes: 0 done; 1 something was found (a packet that is none, a failed",
            "check, a difference), or the output cannot be written; 2 wrong usage or an",
            "unreadable file; 3 the peer could not be reached, hung up or never answered;",
            "130 interrupted.",
            "",
            "`openpendant packets TOOL --help` lists a tool's own options.",
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
