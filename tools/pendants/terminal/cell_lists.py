"""Lists of what the cell has beside programs: recordings, frames, tools, scene, signals.

Owns what each entry of a list says and does when it is selected. The lists are the server's answers
at one moment; a change names the revision of the list, and the server refuses one that is old.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from .commands import (
    AskList,
    AskPairingCode,
    CellList,
    ChooseTool,
    Command,
    EndPairing,
    EndRecording,
    PlayBack,
    SwitchOutput,
)
from .prompts import Choice, TextEntry, TextPurpose


@dataclass(frozen=True, slots=True)
class ChosenFrame:
    """A frame that was chosen to jog in."""

    name: str


Selected = Command | Choice | TextEntry | ChosenFrame
"""What an entry does when it is selected."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of a list.

    Attributes:
        does: None for an entry that only says something.
    """

    text: str
    does: Selected | None = None


@dataclass(frozen=True, slots=True)
class Listing:
    """A list on the display, of which Enter takes an entry and Escape none."""

    title: str
    entries: tuple[Entry, ...]
    selected: int = 0

    def struck(self, key: str) -> Listing | Selected | None:
        """Return what a key makes of it; None where it is closed."""
        match key:
            case "escape":
                return None
            case "enter":
                return self.entries[self.selected].does if self.entries else None
            case "up" | "down":
                last = max(0, len(self.entries) - 1)
                by = 1 if key == "down" else -1
                return replace(self, selected=max(0, min(self.selected + by, last)))
        return self


def lists_choice() -> Choice:
    """Return the question which list is wanted; the pairing code is an admin's."""
    options: dict[str, tuple[str, Command | Choice]] = {
        str(number): (each.value, AskList(each)) for number, each in enumerate(CellList, 1)
    }
    pairing = Choice("Pairing code", {"1": ("new", AskPairingCode()), "2": ("end", EndPairing())})
    return Choice("Show?", {**options, str(len(options) + 1): ("pairing", pairing)})


def listing_of(kind: CellList, answer: Mapping[str, Any]) -> Listing:
    """Return the list of a server's answer.

    Raises:
        KeyError, TypeError, ValueError: the answer is none of its kind.
    """
    match kind:
        case CellList.RECORDINGS:
            entries = _recordings(answer)
        case CellList.FRAMES:
            named = [str(name) for name in answer["names"]]
            entries = [Entry(name, ChosenFrame(name)) for name in named]
        case CellList.TOOLS:
            entries = _tools(answer)
        case CellList.SCENE:
            entries = [Entry(_in_words(each)) for each in answer["content"]["objects"]]
        case CellList.SIGNALS:
            entries = _signals(answer)
    return Listing(kind.value, tuple(entries))


def _recordings(answer: Mapping[str, Any]) -> list[Entry]:
    under_way = answer["recording"]
    if under_way is None:
        first = Entry("new: type its name", TextEntry(TextPurpose.RECORDING))
    else:
        first = Entry(f"stop {under_way['name']}", EndRecording())
    return [first, *map(_recording, answer["recordings"])]


def _recording(told: Mapping[str, Any]) -> Entry:
    name, duration = str(told["name"]), told.get("duration")
    length = "" if duration is None else f"  {float(duration):.1f} s"
    play = Choice(f"Play {name}?", {"1": ("yes", PlayBack(name))})
    return Entry(f"{name}{length}", play)


def _tools(answer: Mapping[str, Any]) -> list[Entry]:
    revision, content = int(answer["tools_revision"]), answer["content"]
    selected = content.get("selected_tool")
    names: Sequence[str | None] = [None, *(str(tool["name"]) for tool in content["tools"])]
    return [
        Entry(
            f"{'*' if name == selected else ' '}{'no tool' if name is None else name}",
            ChooseTool(name, revision),
        )
        for name in names
    ]


def _in_words(told: Mapping[str, Any]) -> str:
    x, y, z = (1000.0 * float(value) for value in told["position"])
    frame = told.get("frame") or "base"
    return f"{told['name']}  {x:.0f} {y:.0f} {z:.0f} mm in {frame}"


def _signals(answer: Mapping[str, Any]) -> list[Entry]:
    if not answer["offered"]:
        return [Entry("the controller offers none")]
    outputs = [
        Entry(f"output {number} {_lamp(value)}", SwitchOutput(number, not value))
        for number, value in enumerate(answer["outputs"])
    ]
    inputs = enumerate(answer["inputs"])
    return [*outputs, *(Entry(f"input {number} {_lamp(value)}") for number, value in inputs)]


def _lamp(value: object) -> str:
    return "ON" if value else "off"
