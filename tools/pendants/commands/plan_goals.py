"""The goal of a plan as options of a command: JSON texts and files, read into a request's goal.

Owns which options go together and how a pose is written; what a number may be is the server's to
say.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Never, cast

from openpendant.simplemsg.pendant.management.plans import Goal

from ..connection_errors import WrongArgument
from ..motions import quaternion_of

_LARGEST_FILE = 1 << 20  # bytes
_LONGEST_SHOWN = 60

_A_POSE = '{"xyz": [x, y, z], "quat": [x, y, z, w]} or {"xyz": ..., "rpy": [r, p, y]}'
_WAYS = {"to": (), "goal": ("ptp", "free"), "pose": ("ptp", "lin", "free"), "path": ("ptp", "lin")}
"""The ways that each option of a goal takes; the first of them where none is given."""

_OF_FREE = ("planner", "seed", "time_limit", "margin")


@dataclass(frozen=True, slots=True)
class PlanGoal:
    """A goal as it was typed; which joints slide is known at the cell only.

    Attributes:
        kind: as the request names it.
        points: what was read: a joint list, a pose, or the waypoints of a path.
        fields: of the goal beside.
        in_degrees: whether angles are degrees.
    """

    kind: str
    points: Sequence[object] = ()
    fields: Mapping[str, object] = field(default_factory=dict)
    in_degrees: bool = False

    def request(self, slides: Sequence[bool]) -> Goal:
        """Return the goal of a request.

        Args:
            slides: (n,) whether each joint is a linear axis.

        Raises:
            WrongArgument: a text is no goal.
        """
        made: dict[str, object] = {"kind": self.kind, **self.fields}
        read = [self._point(each, slides) for each in self.points]
        frames = {frame for _, frame in read if frame is not None}
        if len(frames) > 1:
            raise WrongArgument(f"the poses of one path need one frame, not {_listed(frames)}")
        if frames:
            made["frame"] = frames.pop()
        if self.kind == "path":
            made["waypoints"] = [point for point, _ in read]
        elif read:
            point, _ = read[0]
            made["pose" if isinstance(point, dict) else "joints"] = point
        return cast(Goal, made)

    def _point(self, told: object, slides: Sequence[bool]) -> tuple[object, str | None]:
        """Return joints or a pose, and the frame that it names."""
        if isinstance(told, dict):
            return self._pose(told)
        joints = _numbers(told, "a list of joint values, or a pose", None)
        if not self.in_degrees:
            return joints, None
        if len(joints) != len(slides):
            raise WrongArgument(f"{len(joints)} joint values for {len(slides)} joints")
        pairs = zip(joints, slides, strict=True)
        return [each if is_length else math.radians(each) for each, is_length in pairs], None

    def _pose(self, told: dict[str, object]) -> tuple[object, str]:
        angles = {"quat", "rpy"} & told.keys()
        frame = told.get("frame", "base")
        is_pose = "xyz" in told and len(angles) == 1 and told.keys() <= {"xyz", "frame"} | angles
        if not is_pose or not isinstance(frame, str):
            raise WrongArgument(f"{_shown(told)} is no pose; accepted: {_A_POSE}")
        if "quat" in told:
            quaternion = _numbers(told["quat"], "four numbers as quat", 4)
        else:
            rpy = _numbers(told["rpy"], "three numbers as rpy", 3)
            roll, pitch, yaw = map(math.radians, rpy) if self.in_degrees else rpy
            quaternion = list(quaternion_of(roll, pitch, yaw))
        position = _numbers(told["xyz"], "three numbers as xyz", 3)
        return {"position": position, "orientation": quaternion}, frame


def plan_goal(arguments: argparse.Namespace) -> PlanGoal:
    """Read the goal of a command's options.

    Raises:
        WrongArgument: options that do not go together, or a text or file that is no goal.
    """
    option = next(each for each in _WAYS if getattr(arguments, each) is not None)
    text: str = getattr(arguments, option)
    kind = _kind(option, arguments.way)
    fields = {each: getattr(arguments, each) for each in ("branch", *_OF_FREE)}
    given = {name: value for name, value in fields.items() if value is not None}
    for name in given:
        wanted = "--way free" if name in _OF_FREE else "--pose and --way ptp"
        if (kind != "free") if name in _OF_FREE else (option, kind) != ("pose", "ptp"):
            raise WrongArgument(f"--{name.replace('_', '-')} needs {wanted}")
    if option == "to":
        return PlanGoal("position", fields={"name": text})
    if option == "path":
        points = _parsed(_content(text), f"{text}: no JSON")
        if not isinstance(points, list) or not points:
            raise WrongArgument(f"{text}: accepted: a JSON list of joint lists, or of poses")
        return PlanGoal("path", points, {"way": kind}, in_degrees=arguments.degrees)
    point = _parsed(text, f"--{option} {text[:_LONGEST_SHOWN]!r} is no JSON")
    if isinstance(point, dict) is not (option == "pose"):
        raise WrongArgument(f"--{option} {text[:_LONGEST_SHOWN]!r}; accepted: {_accepted(option)}")
    return PlanGoal(kind, [point], given, in_degrees=arguments.degrees)


def _accepted(option: str) -> str:
    return _A_POSE if option == "pose" else "a JSON list of joint values"


def _kind(option: str, way: str | None) -> str:
    ways = _WAYS[option]
    if way is None:
        return ways[0] if ways else "position"
    if way not in ways:
        raise WrongArgument(f"--{option} takes {'no --way' if not ways else _listed(ways)}")
    return way


def _listed(words: Iterable[str]) -> str:
    return " or ".join(sorted(words))


def _content(file: str) -> str:
    try:
        with open(file, encoding="utf-8") as opened:
            text = opened.read(_LARGEST_FILE + 1)
    except (OSError, UnicodeDecodeError) as error:
        raise WrongArgument(f"{file}: {getattr(error, 'strerror', None) or error}") from None
    if len(text) > _LARGEST_FILE:
        raise WrongArgument(f"{file}: larger than {_LARGEST_FILE} characters")
    return text


def _parsed(text: str, otherwise: str) -> Any:
    def refuse(number: str) -> Never:
        raise ValueError(number)

    try:
        return json.loads(text, parse_int=float, parse_constant=refuse)
    except (ValueError, RecursionError):
        raise WrongArgument(otherwise) from None


def _numbers(told: object, accepted: str, count: int | None) -> list[float]:
    is_list = isinstance(told, list) and all(isinstance(each, float) for each in told)
    if not is_list or count not in (None, len(cast(list[float], told))):
        raise WrongArgument(f"{_shown(told)}; accepted: {accepted}")
    numbers = cast(list[float], told)
    if not all(map(math.isfinite, numbers)):
        raise WrongArgument(f"{_shown(told)}; accepted: finite numbers")
    return numbers


def _shown(told: object) -> str:
    text = json.dumps(told)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
