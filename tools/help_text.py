"""Help texts of all commands in one style, whichever library wrote them, with an example each.

Owns the examples, by the words of a command, and the heads of a help text. The standard library is
enough to load it.
"""

from __future__ import annotations

import contextlib
import io
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence

EXAMPLES: Mapping[str, str] = {
    "start": "start --robot ur5",
    "demo": "demo --robot abb_irb2400",
    "serve": "serve --robot ur5 --controller 127.0.0.1:12000:12002",
    "emulate": "emulate --robot ur5",
    "pendant": "pendant 192.168.1.20 --cell left",
    "gamepad": "gamepad --device /dev/input/js0",
    "keypad": "keypad --port /dev/ttyACM0",
    "emulate-keypad": "emulate-keypad --link /tmp/keypad",
    "web": "web --server 127.0.0.1:11010 --port 8080",
    "stop": "stop --server 192.168.1.20",
    "reset": "reset",
    "home": "home --speed 0.2",
    "run": "run pick",
    "robots": "robots list",
    "robots list": "robots list --json",
    "robots show": "robots show ur5",
    "robots draw": "robots draw ur5 -o ur5.png",
    "robots check": "robots check my_arm.yaml",
    "robots home-check": "robots home-check ur5",
    "robots import": "robots import my_arm.urdf -o my_arm.yaml",
    "robots fk": "robots fk ur5 --joints [0,-90,90,0,90,0] --degrees",
    "robots jacobian": "robots jacobian ur5 --degrees --joints [0,-90,90,-90,-90,0]",
    "robots ik": 'robots ik ur5 --pose \'{"xyz":[0.4,0.1,0.3],"rpy":[3,0,0]}\'',
    "plan": "plan --robot ur5 --goal [-0.2,-1.3,1.4,-1.6,-1.6,0]",
    "store": "store list",
    "store list": "store list",
    "store show": "store show program pick",
    "store export": "store export all.json",
    "store import": "store import all.json --replace",
    "store delete": "store delete program pick",
    "store backup": "store backup copy.db",
    "store check": "store check",
    "users": "users list",
    "users list": "users list",
    "users add": "users add ada --role admin",
    "users remove": "users remove ada",
    "users set-role": "users set-role ada programmer",
    "users set-password": "users set-password ada",
    "users disable": "users disable ada",
    "users enable": "users enable ada",
    "users pair": "users pair --user ada",
    "cells": "cells --server 192.168.1.20",
    "connections": "connections close 7",
    "audit": "audit show audit.log",
    "audit show": "audit show audit.log",
    "audit verify": "audit verify audit.log",
    "program": "program check pick.txt",
    "program check": "program check pick.txt --robot ur5",
    "program print": "program print pick.txt",
    "program convert": "program convert pick.txt --output pick.json",
    "why": "why --kind jog",
    "packets": "packets send 127.0.0.1:12000 ping",
    "packets decode": "packets decode capture.pcap",
    "packets encode": "packets encode packets.jsonl",
    "packets show": "packets show traffic.jsonl",
    "packets record": "packets record --listen 13000 --to 12000 -o traffic.jsonl",
    "packets replay": "packets replay traffic.jsonl --as client --to 12000",
    "packets faults": "packets faults cut.toml --listen 13000 --to 127.0.0.1:12000",
    "packets send": "packets send 127.0.0.1:12000 ping",
    "packets conformance": "packets conformance --role server 127.0.0.1:12000:12002",
    "packets rerun": "packets rerun demo-output/demo-ur5-server.journal",
    "packets dissector": "packets dissector -o openpendant.lua",
    "completion": "completion bash > openpendant.bash",
}
"""An example of each command, after the word `openpendant`."""

WIDTH = 80
"""Columns that every help text fits."""

HELP = ("-h", "--help")

_HEADS = {
    "usage:": "Usage:",
    "options:": "Options:",
    "positional arguments:": "Arguments:",
    "exit codes:": "Exit codes:",
    "tools:": "Commands:",
}

_HEAD = re.compile(rf"^({'|'.join(map(re.escape, _HEADS))})", re.MULTILINE)


def asks_for_help(arguments: Sequence[str]) -> bool:
    """Return True if arguments ask for a help text, before a `--` that ends the options."""
    before = arguments[: arguments.index("--")] if "--" in arguments else arguments
    return any(each in HELP for each in before)


def run_for_help(main: Callable[[list[str]], int], arguments: list[str]) -> tuple[int, str]:
    """Run a command that is asked for its help; return its exit code and its help text."""
    written = io.StringIO()
    with contextlib.redirect_stdout(written):
        try:
            code = main(arguments)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else 0
    return code, written.getvalue()


def in_one_style(text: str, words: Sequence[str]) -> str:
    """Return a help text with the heads that all have, and the example of its command.

    Args:
        words: of the command, and what follows them.
    """
    styled = _HEAD.sub(lambda head: _HEADS[head[0]], text.rstrip("\n"))
    styled = "\n".join(map(_fitted, styled.split("\n")))
    example = example_of(words)
    return f"{styled}\n\nExample: openpendant {example}" if example else styled


def _fitted(line: str) -> str:
    """Return a line, broken where it is too long; what follows is indented as it is."""
    if len(line) <= WIDTH:
        return line
    indent = line[: len(line) - len(line.lstrip())]
    return textwrap.fill(line, WIDTH, subsequent_indent=indent, break_on_hyphens=False)


def example_of(words: Sequence[str]) -> str:
    """Return the example of the longest command that words begin with; empty for none."""
    named = [each for each in words if not each.startswith("-")]
    paths = (" ".join(named[:count]) for count in range(len(named), 0, -1))
    return next((EXAMPLES[path] for path in paths if path in EXAMPLES), "")
