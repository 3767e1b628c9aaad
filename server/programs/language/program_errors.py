"""Program errors: the faults of a program by kind, each with its verdict code.

Owns the wording of a place in a file: `name:line:column`. An `index` is the number of a statement,
from 0.
"""

from __future__ import annotations

from openpendant.simplemsg.pendant.management.program_values import ProgramError
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal

_LONGEST_EXCERPT = 40
_LONGEST_FIELD = 120


def excerpt(text: str) -> str:
    """Return text from outside for a message: short, printable, quoted."""
    return ascii(text if len(text) <= _LONGEST_EXCERPT else text[:_LONGEST_EXCERPT] + "...")


class ProgramSyntaxError(ProgramError):
    """Text that the parser refuses.

    Attributes:
        line: line of the place, from 1.
        column: character of the place in its line, from 1, counted in Unicode code points.
        accepted: what would be taken there; empty where `problem` says it.
        code: PROGRAM_SYNTAX, or the code of the rule that the place breaks.
    """

    def __init__(
        self,
        file: str,
        line: int,
        column: int,
        problem: str,
        accepted: str = "",
        *,
        code: VerdictCode = VerdictCode.PROGRAM_SYNTAX,
    ) -> None:
        ending = f"; accepted: {accepted}" if accepted else ""
        super().__init__(f"{file}:{line}:{column}: {problem}{ending}")
        self.file, self.line, self.column = file, line, column
        self.problem, self.accepted = problem, accepted
        self.code = code


class JsonRefused(ProgramError):
    """A JSON text that is no program.

    Attributes:
        field: the field at fault, such as `points[3].joints`; empty for the whole.
    """

    def __init__(
        self,
        file: str,
        field: str,
        problem: str,
        code: VerdictCode = VerdictCode.PROGRAM_SYNTAX,
    ) -> None:
        where = f"{field[:_LONGEST_FIELD]}: " if field else ""
        super().__init__(f"{file}: {where}{problem}")
        self.file, self.field = file, field
        self.code = code


class ProgramTooLarge(ProgramError):
    """A program, or a part of it, exceeds its cap."""

    code = VerdictCode.PROGRAM_TOO_LARGE

    def __init__(self, what: str, value: int, limit: int, *, is_counted: bool = True) -> None:
        """Take the numbers of the excess.

        Args:
            value: how many there are, or how many were seen before counting ended.
            is_counted: True if `value` is all there is.
        """
        counted = f"{value}" if is_counted else f"{value} or more"
        super().__init__(f"{counted} {what}; accepted: up to {limit}")
        self.what, self.value, self.limit = what, value, limit


class StatementRefused(ProgramError):
    """A statement that does not fit the others, with its place in words."""

    def __init__(self, place: str, index: int, fault: ProgramError) -> None:
        super().__init__(f"{place}: {fault}")
        self.index = index
        self.code = fault.code


class BadBlocks(ProgramError):
    """Loops and conditions that do not close, or nest too deep; the text has no place."""

    def __init__(self, index: int, problem: str) -> None:
        super().__init__(problem)
        self.index, self.problem = index, problem


class PointUnknown(ProgramError):
    """A name that no point of the program has; the text has no place.

    Attributes:
        index: the statement that uses it, from 0; None for none.
        place: which of the names in that statement it is, from 0.
    """

    code = VerdictCode.POINT_UNKNOWN

    def __init__(
        self, name: str, known: tuple[str, ...], index: int | None = None, place: int = 0
    ) -> None:
        super().__init__(f"no point is named {excerpt(name)}; {_listed(known, 'points')}")
        self.name, self.index, self.place = name, index, place


class PointExists(ProgramError):
    """Two points of one name."""

    code = VerdictCode.POINT_EXISTS

    def __init__(self, name: str) -> None:
        super().__init__(f"there is a point {excerpt(name)} already; accepted: a name of its own")
        self.name = name


class PointInUse(ProgramError):
    """A point that statements go to cannot be deleted."""

    code = VerdictCode.POINT_IN_USE

    def __init__(self, name: str, indexes: tuple[int, ...], places: str) -> None:
        super().__init__(f"point {excerpt(name)} is used in {places}")
        self.name, self.indexes = name, indexes


class PointInconsistent(ProgramError):
    """The joints of a point put the tool elsewhere than its pose says.

    Attributes:
        distance: between both places [m].
        angle: between both orientations [rad].
    """

    code = VerdictCode.POINT_INCONSISTENT

    def __init__(self, name: str, distance: float, angle: float, within: str) -> None:
        super().__init__(
            f"the joints of point {excerpt(name)} put the tool {distance:.6f} m and"
            f" {angle:.6f} rad from its pose; accepted: within {within}"
        )
        self.name, self.distance, self.angle = name, distance, angle


class WrongRobot(ProgramError):
    """A program that was taught on another robot."""

    code = VerdictCode.PROGRAM_WRONG_ROBOT


class ProgramUnknown(ProgramError):
    """A call of a program that is not there.

    Attributes:
        index: the statement of the call, from 0.
        problem: what is wrong, without the place.
    """

    code = VerdictCode.PROGRAM_UNKNOWN

    def __init__(self, name: str, caller: str, index: int, place: str) -> None:
        problem = f"there is no program {excerpt(name)} to call"
        super().__init__(f"program {excerpt(caller)}, {place}: {problem}")
        self.name, self.caller, self.index, self.problem = name, caller, index, problem


class CallTooDeep(ProgramError):
    """Programs that call each other in a circle, or through too many levels.

    Attributes:
        chain: the programs, the first caller first.
    """

    code = VerdictCode.CALL_TOO_DEEP

    def __init__(self, chain: tuple[str, ...], problem: str) -> None:
        shown = " calls ".join(excerpt(name) for name in chain)
        super().__init__(f"{shown}: {problem}")
        self.chain = chain


class NothingToUndo(ProgramError):
    """There is no edit to undo, or none to redo."""

    code = VerdictCode.NOTHING_TO_UNDO


def _listed(names: tuple[str, ...], what: str) -> str:
    if not names:
        return f"there are no {what}"
    shown = ", ".join(excerpt(name) for name in names[:8])
    return f"{what}: {shown}{', ...' if len(names) > 8 else ''}"


def program_refusal(error: ProgramError) -> Refusal:
    """Return the refusal that says what an error says, numbers included."""
    if isinstance(error, ProgramTooLarge):
        return Refusal(error.code, str(error), value=error.value, limit=error.limit)
    return Refusal(error.code, str(error))
