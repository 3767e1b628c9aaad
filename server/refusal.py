"""Refusals: verdict code, sentence and numbers of a refused request or an aborted motion.

Owns the one mapping from an error of `motion` to a code of the verdict catalogue, the model that
some replies to management requests extend (`JsonBody`), and the sentence about data from
outside whose fields break a rule. That sentence names the place and the rule, never the value that
stood there, because the value may be a secret. Must not know any operation; `management` has the
table of all.
"""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict, ValidationError

from openpendant.motion import errors
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

NO_JOINT = -1


@dataclass(frozen=True, slots=True)
class Refusal:
    """One reason.

    Attributes:
        text: one sentence with the numbers; the catalogue's cause where there are none.
        joint: index of the joint at fault, -1 for none.
        value: the value at fault, SI.
        limit: the limit that it breaks, SI.
    """

    code: VerdictCode
    text: str = ""
    joint: int = NO_JOINT
    value: float = 0.0
    limit: float = 0.0

    @property
    def sentence(self) -> str:
        """The text, or the catalogue's cause."""
        return self.text or CATALOGUE[self.code].cause


CODE_OF_ERROR: dict[type[errors.MotionError], VerdictCode] = {
    errors.BadArgument: VerdictCode.BAD_ARGUMENT,
    errors.NotFinite: VerdictCode.NOT_FINITE,
    errors.WrongJointCount: VerdictCode.WRONG_JOINT_COUNT,
    errors.FrameUnknown: VerdictCode.UNKNOWN_FRAME,
    errors.OutOfRange: VerdictCode.OUT_OF_RANGE,
    errors.TooFast: VerdictCode.TOO_FAST,
    errors.TooSharp: VerdictCode.TOO_SHARP,
    errors.PoseUnreachable: VerdictCode.UNREACHABLE,
    errors.BranchChange: VerdictCode.BRANCH_CHANGE,
    errors.NotTimeable: VerdictCode.NOT_TIMEABLE,
    errors.NoMotion: VerdictCode.NO_MOTION,
    errors.CertificateRefused: VerdictCode.CERTIFICATE_REFUSED,
    errors.RobotFileError: VerdictCode.BAD_ARGUMENT,
    errors.UnknownRobot: VerdictCode.BAD_ARGUMENT,
    errors.UnsupportedKind: VerdictCode.BAD_ARGUMENT,
    errors.FrameExists: VerdictCode.FRAME_REFUSED,
    errors.FrameCycle: VerdictCode.FRAME_REFUSED,
    errors.FramePredefined: VerdictCode.FRAME_REFUSED,
    errors.FrameInUse: VerdictCode.FRAME_REFUSED,
    errors.NotInHistory: VerdictCode.NOT_IN_HISTORY,
    errors.PoorGeometry: VerdictCode.POOR_GEOMETRY,
    errors.FrameFileError: VerdictCode.BAD_FILE,
    errors.SceneFileError: VerdictCode.BAD_FILE,
    errors.SceneTooLarge: VerdictCode.TOO_LARGE,
    errors.MeshFileError: VerdictCode.BAD_FILE,
    errors.PlatformLimit: VerdictCode.PLATFORM_LIMIT,
    errors.NoAssembly: VerdictCode.NO_ASSEMBLY,
    errors.LibraryMissing: VerdictCode.NOT_INSTALLED,
    errors.PlannerUnavailable: VerdictCode.NOT_INSTALLED,
    errors.UnknownObject: VerdictCode.UNKNOWN_OBJECT,
    errors.NothingGripped: VerdictCode.NOTHING_GRIPPED,
    errors.ObjectHeld: VerdictCode.NOT_HELD,
    errors.ObjectNotHeld: VerdictCode.NOT_HELD,
    errors.DuplicateObject: VerdictCode.DUPLICATE_OBJECT,
    errors.StartInCollision: VerdictCode.START_IN_COLLISION,
    errors.GoalInCollision: VerdictCode.GOAL_IN_COLLISION,
    errors.PathInCollision: VerdictCode.PATH_IN_COLLISION,
    errors.NoPathFound: VerdictCode.NO_PATH_FOUND,
    errors.BadCircle: VerdictCode.BAD_CIRCLE,
    errors.ZoneTooLarge: VerdictCode.ZONE_TOO_LARGE,
    errors.SegmentRefused: VerdictCode.BAD_ARGUMENT,
}
"""One code for each kind of motion error; a test demands that none is missing."""


def refusal_of(error: errors.MotionError) -> Refusal:
    """Return the refusal that says what a motion error says, numbers included."""
    cause = error
    while isinstance(cause, errors.SegmentRefused):
        cause = cause.reason
    return Refusal(CODE_OF_ERROR[type(cause)], str(error), *cause.numbers)


def field_fault(error: ValidationError) -> str:
    """Return the first place that is wrong, and how, as one sentence."""
    first = error.errors(include_url=False, include_input=False, include_context=False)[0]
    where = ".".join(str(part) for part in first["loc"])
    return f"{where}: {first['msg']}" if where else first["msg"]


class JsonBody(BaseModel):
    """One JSON object; an unknown key is refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)
