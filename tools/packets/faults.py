"""`openpendant packets faults`: a proxy that breaks the traffic by a seeded script."""

from __future__ import annotations

import argparse
import asyncio
import json
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from ..console import ExitCode, complain
from .console import PacketToolError, parser, run
from .faulty.fault_catalogue import explain, list_faults
from .faulty.fault_engine import FaultDone, FaultEngine, FaultRelay, fault_to_json
from .faulty.fault_script import FaultScript, load_script
from .live.line_output import LineOutput
from .live.proxy import Pair, Proxy
from .live.serving import (
    add_pairs,
    pairs_of,
    progress_line,
    report_loop_errors,
    say_ready,
    stop_on_signals,
)

_EPILOG = """\
The script is a TOML file of rules; the first that fits a frame acts on it, and no other. The same
script, seed and traffic give the same faults. --list shows all faults, --explain a script in words.

examples:
  openpendant packets faults --list
  openpendant packets faults --explain lost-reply.toml
  openpendant packets faults --listen 11000 --to 12000 lost-reply.toml --seed 7 --log done.jsonl

exit codes: 0 ended on request; 1 the log could not be written to its end; 2 wrong usage or script,
or the log cannot be opened; 3 a port cannot be listened on.
"""

_NANOSECONDS = 1e9


class FaultProxy:
    """A proxy, the relay that breaks its traffic, and the log."""

    def __init__(
        self,
        pairs: Sequence[Pair],
        script: FaultScript,
        *,
        seed: int | None = None,
        log: str | None = None,
        on_end: Callable[[str], None] = lambda reason: None,
    ) -> None:
        """Make a proxy that has touched nothing yet; needs a running loop."""
        self.done: Counter[str] = Counter()
        self.output = LineOutput(log, on_end=on_end) if log is not None else None
        self._began = round(asyncio.get_running_loop().time() * _NANOSECONDS)
        self.relay = FaultRelay(FaultEngine(script, seed, self._note))
        self._proxy = Proxy(pairs, self.relay)

    @property
    def connections(self) -> int:
        """Connections now open."""
        return len(self._proxy.links)

    def _note(self, done: FaultDone) -> None:
        self.done[done.fault] += 1
        if self.output is not None and not self.output.ended:
            self.output.write(json.dumps(fault_to_json(done, self._began)))

    async def start(self) -> list[int]:
        """Listen, open the log, and return the ports; PeerError or OSError, and nothing listens."""
        try:
            ports = await self._proxy.start()
            if self.output is not None:
                self.output.start()
        except BaseException:
            await self.close()
            raise
        return ports

    async def close(self) -> None:
        """Drop the connections and complete the log."""
        await self._proxy.close()
        if self.output is not None:
            await self.output.close()


def main(argv: list[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run(_parser(), _faults, argv)


def _parser() -> argparse.ArgumentParser:
    command = parser(
        "faults", "Stand between client and server and break the traffic by a script.", _EPILOG
    )
    command.add_argument("script", nargs="?", type=Path, metavar="SCRIPT.toml")
    command.add_argument("--list", action="store_true", help="print all faults and leave")
    command.add_argument("--explain", action="store_true", help="print the script in words, leave")
    add_pairs(command, required=False)
    command.add_argument("--seed", type=int, help="of random choices (default: the script's)")
    command.add_argument("--log", metavar="FILE", help="a JSON line for each fault; - for stdout")
    return command


def _faults(arguments: argparse.Namespace) -> int:
    if arguments.list:
        print(list_faults())
        return ExitCode.OK
    if arguments.script is None:
        raise PacketToolError("a script is needed; --list shows what it can say")
    script = load_script(arguments.script)
    if arguments.explain:
        print(explain(script))
        return ExitCode.OK
    return asyncio.run(_break(pairs_of(arguments), script, arguments))


async def _break(pairs: list[Pair], script: FaultScript, arguments: argparse.Namespace) -> int:
    proxy = FaultProxy(
        pairs,
        script,
        seed=arguments.seed,
        log=arguments.log,
        on_end=lambda reason: complain(f"the log ends here: {reason}; traffic goes on"),
    )
    report_loop_errors()
    ports = await proxy.start()
    stop = asyncio.Event()
    stop_on_signals(stop)
    say_ready("faults", pairs, ports, as_json=arguments.json, on_stderr=arguments.log == "-")
    try:
        with progress_line(lambda seconds: _progress_of(proxy)):
            await stop.wait()
    finally:
        await proxy.close()
    complain(_progress_of(proxy))
    failed = proxy.output is not None and proxy.output.failed
    return ExitCode.FAILED if failed else ExitCode.OK


def _progress_of(proxy: FaultProxy) -> str:
    counts = ", ".join(f"{count} {fault}" for fault, count in proxy.done.most_common())
    faults = f"faults: {counts}" if counts else "no faults yet"
    return f"{proxy.relay.frames} frames, {proxy.connections} connections, {faults}"
