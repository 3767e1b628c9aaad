"""Summary of a trace: number, rate and size of the packets of each kind."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..trace import TraceDirection
from .presentation import comm_name
from .reader import Reading

MAX_KINDS = 10_000
"""Most kinds counted apart; packets of further kinds are counted together."""

_NANOSECONDS = 1_000_000_000
_HEADINGS = (
    "direction", "type", "name", "comm", "count", "malformed", "rate/s", "first", "last",
    "bytes", "latency/ms",
)  # fmt: skip


@dataclass(slots=True)
class _Tally:
    """Counts of one kind of packet."""

    count: int = 0
    malformed: int = 0
    size: int = 0
    answered: int = 0
    latency: int = 0
    first: int | None = None
    last: int = 0
    spans: dict[str, tuple[int, int, int]] = field(default_factory=dict)

    def add(self, reading: Reading) -> None:
        time, scenario = reading.packet.time, reading.packet.scenario
        self.count += 1
        self.malformed += reading.message is None
        self.size += len(reading.packet.data)
        self.first = time if self.first is None else min(self.first, time)
        self.last = max(self.last, time)
        if reading.latency is not None:
            self.answered += 1
            self.latency += reading.latency
        begin, _, count = self.spans.get(scenario, (time, time, 0))
        if scenario in self.spans or len(self.spans) < MAX_KINDS:
            self.spans[scenario] = (begin, time, count + 1)

    def rate(self) -> float | None:
        """Packets a second; time runs anew in each scenario."""
        passed = sum(end - begin for begin, end, _ in self.spans.values())
        intervals = sum(count - 1 for _, _, count in self.spans.values())
        return intervals * _NANOSECONDS / passed if passed > 0 else None


_Kind = tuple[str, int | None, str, str]


class Summary:
    """Counts packets by direction, type and communication type."""

    def __init__(self) -> None:
        self._tallies: dict[_Kind, _Tally] = {}

    def add(self, reading: Reading) -> None:
        """Count a packet."""
        way = "to-server" if reading.packet.direction is TraceDirection.TO_SERVER else "to-client"
        kind: _Kind = (way, None, "no frame", "")
        if reading.header is not None:
            header = reading.header
            kind = (way, header.msg_type, reading.name, comm_name(header.comm_type))
        if kind not in self._tallies and len(self._tallies) >= MAX_KINDS:
            kind = (way, None, "others", "")
        self._tallies.setdefault(kind, _Tally()).add(reading)

    def rows(self) -> list[dict[str, Any]]:
        """Return a JSON object for each kind: times in seconds, mean latency in seconds."""
        rows: list[dict[str, Any]] = []
        for (way, msg_type, name, comm), tally in sorted(
            self._tallies.items(), key=lambda item: (item[0][0], item[0][1] or 0, item[0][3])
        ):
            answered = tally.answered
            rows.append(
                {
                    "direction": way,
                    "msg_type": msg_type,
                    "name": name,
                    "comm": comm,
                    "count": tally.count,
                    "malformed": tally.malformed,
                    "rate": tally.rate(),
                    "first": (tally.first or 0) / _NANOSECONDS,
                    "last": tally.last / _NANOSECONDS,
                    "bytes": tally.size,
                    "latency": tally.latency / answered / _NANOSECONDS if answered else None,
                }
            )
        return rows

    def table(self) -> str:
        """Return the rows as a table."""
        cells = [list(_HEADINGS), *(_cells(row) for row in self.rows())]
        widths = [max(len(line[column]) for line in cells) for column in range(len(_HEADINGS))]
        left = {0, 2, 3}
        return "\n".join(
            "  ".join(
                text.ljust(width) if column in left else text.rjust(width)
                for column, (text, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in cells
        )


def _cells(row: dict[str, Any]) -> list[str]:
    rate, latency = row["rate"], row["latency"]
    return [
        row["direction"],
        "" if row["msg_type"] is None else str(row["msg_type"]),
        row["name"],
        row["comm"],
        str(row["count"]),
        str(row["malformed"]),
        "" if rate is None else f"{rate:.1f}",
        f"{row['first']:.3f}",
        f"{row['last']:.3f}",
        str(row["bytes"]),
        "" if latency is None else f"{latency * 1000:.3f}",
    ]
