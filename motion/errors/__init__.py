"""The typed refusals of `motion`: one class per kind, with the numbers as attributes.

Owns the catalogue of codes and the sentence of each refusal, a module for each thing that can be at
fault. Knows no robot, no wire format and no library: values arrive as plain numbers, with the unit
of the joint they belong to (`rad` for a revolute joint, `m` for a prismatic one).

    MotionError
    ├── questions: what was asked is malformed, or needs what is not installed
    │       BadArgument, NotFinite, WrongJointCount, PlannerUnavailable, LibraryMissing
    ├── robots:    the robot: its file, its name, its kind
    │       RobotFileError, UnknownRobot, UnsupportedKind
    ├── limits:    a limit of a joint would be broken
    │       OutOfRange, TooFast, TooSharp, CertificateRefused
    ├── motions:   the question is sound, but no such motion exists
    │       Unreachable, BranchChange, NotTimeable, NoMotion, NoPathFound
    ├── paths:     the geometry of a path: a circle, a zone, one segment of several
    │       BadCircle, ZoneTooLarge, SegmentRefused
    ├── frames:    the frames: a change, the past, teaching, a file
    │       FrameUnknown, FrameExists, FrameCycle, FramePredefined, FrameInUse,
    │       NotInHistory, PoorGeometry, FrameFileError
    ├── scene:     the scene: a name, a file, two bodies that touch
    │       UnknownObject, DuplicateObject, SceneTooLarge, SceneFileError,
    │       MeshFileError, StartInCollision, GoalInCollision, PathInCollision
    └── platform:  a parallel robot's own limits
            PlatformLimit, NoAssembly
"""

from __future__ import annotations

from .frames import (
    FrameCycle,
    FrameExists,
    FrameFileError,
    FrameInUse,
    FramePredefined,
    FrameUnknown,
    NotInHistory,
    PoorGeometry,
)
from .limits import CertificateRefused, OutOfRange, TooFast, TooSharp
from .motion_error import MotionError
from .motions import BranchChange, NoMotion, NoPathFound, NotTimeable, Unreachable
from .paths import BadCircle, CircleFault, SegmentRefused, ZoneTooLarge
from .platform import NoAssembly, PlatformLimit
from .questions import BadArgument, LibraryMissing, NotFinite, PlannerUnavailable, WrongJointCount
from .robots import RobotFileError, UnknownRobot, UnsupportedKind
from .scene import (
    DuplicateObject,
    GoalInCollision,
    MeshFileError,
    PathInCollision,
    SceneFileError,
    SceneTooLarge,
    StartInCollision,
    UnknownObject,
)

__all__ = [
    "BadArgument",
    "BadCircle",
    "BranchChange",
    "CertificateRefused",
    "CircleFault",
    "DuplicateObject",
    "FrameCycle",
    "FrameExists",
    "FrameFileError",
    "FrameInUse",
    "FramePredefined",
    "FrameUnknown",
    "GoalInCollision",
    "LibraryMissing",
    "MeshFileError",
    "MotionError",
    "NoAssembly",
    "NoMotion",
    "NoPathFound",
    "NotFinite",
    "NotInHistory",
    "NotTimeable",
    "OutOfRange",
    "PathInCollision",
    "PlannerUnavailable",
    "PlatformLimit",
    "PoorGeometry",
    "RobotFileError",
    "SceneFileError",
    "SceneTooLarge",
    "SegmentRefused",
    "StartInCollision",
    "TooFast",
    "TooSharp",
    "UnknownObject",
    "UnknownRobot",
    "Unreachable",
    "UnsupportedKind",
    "WrongJointCount",
    "ZoneTooLarge",
]
