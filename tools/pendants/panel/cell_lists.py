"""Lists of what the cell has beside programs: recordings, frames, tools, scene, positions, plans.

Owns what each entry of a list says and does when it is selected. The lists are the server's answers
at one moment; a change names the revision of the list, and the server refuses one that is old.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from .commands import (
    AskList,
    AskPairingCode,
    CellList,
    ChooseTool,
    Command,
    EndPairing,
    EndRecording,
    ExecutePlan,
    ForgetPlan,
    ForgetPosition,
    GoHome,
    PlanWay,
    PlayBack,
    SwitchOutput,
    TeachPosition,
)
from .prompts import Choice, PositionName, TextEntry, TextPurpose, moving_position


@dataclass(frozen=True, slots=True)
class ChosenFrame:
    """A frame that was chosen to jog in."""

    name: str


Selected: TypeAlias = "Command | Choice | TextEntry | ChosenFrame | Listing"
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


_PLACE_OF_PAIRING = 5
"""Among the lists, from 0: keys that people know stay, and lists that came later follow."""


def lists_choice() -> Choice:
    """Return the question which list is wanted; the pairing code is an admin's."""
    pairing = Choice("Pairing code", {"1": ("new", AskPairingCode()), "2": ("end", EndPairing())})
    options: list[tuple[str, Command | Choice]] = [(each.value, AskList(each)) for each in CellList]
    options.insert(_PLACE_OF_PAIRING, ("pairing", pairing))
    return Choice("Show?", {str(number): each for number, each in enumerate(options, 1)})


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
        case CellList.POSITIONS:
            entries = _positions(answer)
        case CellList.PLANS:
            # The last one that was made is the one that is wanted.
            entries = [_plan(each) for each in reversed(answer["plans"])]
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


def _positions(answer: Mapping[str, Any]) -> list[Entry]:
    revision, told = int(answer["revision"]), answer["positions"]
    own = tuple(str(each["name"]) for each in told if each["kind"] == "user")
    name = PositionName(TextPurpose.POSITION, taken=own, revision=revision)
    return [Entry("new: type its name", name), *(_position(each, revision) for each in told)]


def _position(told: Mapping[str, Any], revision: int) -> Entry:
    """Return the entry of a position; `!` marks one where the robot may not stand."""
    name = str(told["name"])
    x, y, z = (1000.0 * float(value) for value in told["pose"]["position"])
    options: dict[str, tuple[str, Command | Choice]] = {
        "1": ("go there", GoHome(name)),
        "2": ("plan", PlanWay(name)),
    }
    if told["kind"] == "user":
        delete = Choice(f"Delete {name}?", {"1": ("yes", ForgetPosition(name, revision))})
        options["3"] = ("teach", moving_position(TeachPosition(name, revision)))
        options["4"] = ("delete", delete)
    place = f"{name}  {x:.0f} {y:.0f} {z:.0f} mm"
    text = f" {place}" if told["legal"] else f"!{place}: {told['why']}"
    return Entry(text, Choice(name, options))


def _plan(told: Mapping[str, Any]) -> Entry:
    """Return the entry of a plan, which leads to its facts and to what can be done with it."""
    number, state, kind = int(told["plan"]), str(told["state"]), str(told["kind"])
    duration, samples = float(told["duration"]), int(told["samples"])
    execute = Choice(f"Execute plan {number}?", {"1": ("yes", ExecutePlan(number))})
    is_ready = state == "ready"
    facts = [
        # The preview of a program is looked at; who wants the motion runs the program.
        *([Entry("execute", execute)] if is_ready and kind != "program" else []),
        *([Entry("drop", ForgetPlan(number))] if is_ready else []),
        Entry(f"{state}, {float(told['expires_in']):.0f} s left" if is_ready else state),
        Entry(f"{duration:.2f} s, {samples} samples"),
        Entry(f"{kind}, by {told['maker']}"),
        *(Entry(str(told[field])) for field in ("label", "text") if told[field]),
    ]
    listing = Listing(f"plan {number}", tuple(facts))
    return Entry(f"{number} {state}  {duration:.1f} s {kind}  {told['label']}".rstrip(), listing)
