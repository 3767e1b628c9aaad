"""Why a request is refused or a motion aborted, with its numbers; and the table from motion errors.

Owns the one mapping from an error of `motion` to a code of the verdict catalogue.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.motion import errors
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

NO_JOINT = -1


@dataclass(frozen=True, slots=True)
class Refusal:
    """One reason.

    Attributes:
        code: entry of the catalogue.
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
    errors.Unreachable: VerdictCode.UNREACHABLE,
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
    code = CODE_OF_ERROR[type(error)]
    match error:
        case errors.OutOfRange():
            limit = error.lower if error.value < error.lower else error.upper
            return Refusal(code, str(error), error.index, error.value, limit)
        case errors.SegmentRefused():
            inner = refusal_of(error.reason)
            return Refusal(inner.code, str(error), inner.joint, inner.value, inner.limit)
        case errors.PlatformLimit():
            return Refusal(code, str(error), error.index, error.value, error.limit)
        case errors.TooFast() | errors.TooSharp():
            return Refusal(code, str(error), error.index, error.value, error.limit)
        case errors.SceneTooLarge():
            return Refusal(code, str(error), value=float(error.pairs), limit=float(error.limit))
        case errors.WrongJointCount():
            return Refusal(code, str(error), value=float(error.got), limit=float(error.expected))
        case errors.NotFinite():
            return Refusal(code, str(error), error.index)
        case errors.Unreachable():
            # The worse of both residuals: a pose may be out of reach by its turn alone.
            residual = max(error.best_position_error, error.best_rotation_error)
            return Refusal(code, str(error), value=residual)
        case errors.BranchChange():
            return Refusal(code, str(error), value=error.step)
        case errors.NotTimeable():
            return Refusal(code, str(error), value=error.path_length)
        case errors.CertificateRefused():
            return Refusal(code, str(error), value=error.value, limit=error.limit)
    return Refusal(code, str(error))
