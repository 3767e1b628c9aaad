"""Walk tracer: counts the calls of product functions that one event causes on this thread.

Owns what counts: a call of a function whose file lies in one of `ROOMS`. Comprehensions are no
calls of their own, and a generator is one call however often it is resumed, so that the figures do
not depend on the interpreter. The emulator, the tools, the tests and all libraries are left out.
Must not know what an event is: its user names the frames that a walk begins with and leads to.
"""

import gc
import inspect
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from types import FrameType, TracebackType
from typing import Any, Self

ROOMS = ("simplemsg", "motion", "server")
"""Packages of `openpendant` whose functions are counted."""

_COMPREHENSIONS = {"<listcomp>", "<setcomp>", "<dictcomp>", "<genexpr>"}
_RESUMED = inspect.CO_GENERATOR | inspect.CO_COROUTINE | inspect.CO_ASYNC_GENERATOR

OnFrame = Callable[[FrameType], bool]
"""Decides on a frame that has just been entered."""


class WalkFailed(Exception):
    """A walk did not begin, or ended without something that it was to lead to."""


@dataclass(slots=True)
class Walk:
    """What was counted between the first and the last frame.

    Attributes:
        files: calls in each file, in the order in which the files were first entered.
        functions: calls of each function, by file and qualified name, in the same order.
        hops: calls whose caller, the innermost frame that counts, is in another file.
        depth: the most frames that count on the stack at once.
    """

    files: dict[str, int] = field(default_factory=dict)
    functions: dict[tuple[str, str], int] = field(default_factory=dict)
    hops: int = 0
    depth: int = 0

    @property
    def calls(self) -> int:
        """How many calls there were."""
        return sum(self.files.values())


def any_frame(frame: FrameType) -> bool:
    """Return True: a walk begins with the first call of whatever function counts."""
    return True


@cache
def product_file(path: str) -> str | None:
    """Return a file of the product by its room, such as server/shell/app.py; None for any other."""
    for room, folder in _folders():
        if path.startswith(folder):
            return f"{room}/{path.removeprefix(folder).replace(os.sep, '/')}"
    return None


@cache
def _folders() -> tuple[tuple[str, str], ...]:
    """Return each room, and how the names of its files begin."""
    packages = {room: import_module(f"openpendant.{room}").__path__ for room in ROOMS}
    return tuple((room, f"{path}{os.sep}") for room, paths in packages.items() for path in paths)


class Tracer:
    """Traces one walk, on the thread that enters it.

    No garbage is collected meanwhile: a generator or a coroutine that others left behind unfinished
    is entered once more when it is, and would count for whatever event is under way then.

    Attributes:
        walk: what was counted so far.
        is_over: nothing more will be counted.
    """

    def __init__(
        self,
        begins: OnFrame = any_frame,
        leads_to: Sequence[OnFrame] = (),
        *,
        returns: bool = False,
        file_of: Callable[[str], str | None] = product_file,
    ) -> None:
        """Trace nothing yet.

        Args:
            begins: decides on frames that count; the first that it takes is the root.
            leads_to: effects, as frames of whatever file under the root, which do not count
                themselves. The walk has to meet all of them and ends with the last.
            returns: the walk goes on to the return of the root; so it does without effects.
            file_of: from a path to the name of a file whose functions count, or None.
        """
        self.walk = Walk()
        self._begins = begins
        self._missing = list(leads_to)
        self._returns = returns or not leads_to
        self._file_of = file_of
        self.is_over = False
        self._stack: list[tuple[FrameType, str]] = []
        self._generators: set[FrameType] = set()
        self._before: Any = None
        self._collected_before = False

    def __enter__(self) -> Self:
        """Look for the first frame from now on."""
        self._collected_before = gc.isenabled()
        gc.disable()
        self._before = sys.getprofile()
        sys.setprofile(self._profile)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Leave the thread as it was.

        Raises:
            WalkFailed: the walk did not come to its end.
        """
        sys.setprofile(self._before)
        if self._collected_before:
            gc.enable()
        self._stack.clear()
        self._generators.clear()
        if kind is not None:
            return
        if not self.walk.files:
            raise WalkFailed("the walk did not begin: nothing called its first function")
        if self._missing or not self.is_over:
            last = list(self.walk.functions)[-1]
            raise WalkFailed(f"the walk did not come to its end, but to {': '.join(last)}")

    def _profile(self, frame: FrameType, event: str, argument: object) -> None:
        if self.is_over:
            return
        if event == "call":
            self._entered(frame)
        elif event == "return" and self._stack and self._stack[-1][0] is frame:
            self._stack.pop()
            self.is_over = not self._stack

    def _entered(self, frame: FrameType) -> None:
        code = frame.f_code
        if self._stack and self._missing:
            self._missing = [effect for effect in self._missing if not effect(frame)]
            if not self._missing and not self._returns:
                self.is_over = True
                return
        file = self._file_of(code.co_filename)
        if file is None or code.co_name in _COMPREHENSIONS:
            return
        if self._stack or self._begins(frame):
            self._count(frame, file)

    def _count(self, frame: FrameType, file: str) -> None:
        walk, code = self.walk, frame.f_code
        caller = self._stack[-1][1] if self._stack else file
        self._stack.append((frame, file))
        walk.depth = max(walk.depth, len(self._stack))
        if frame in self._generators:
            return
        if code.co_flags & _RESUMED:
            self._generators.add(frame)
        walk.hops += caller != file
        walk.files[file] = walk.files.get(file, 0) + 1
        function = (file, code.co_qualname)
        walk.functions[function] = walk.functions.get(function, 0) + 1
