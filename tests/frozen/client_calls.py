"""The calls of both Python clients as lines of text: names, arguments, kinds, types and defaults.

A line holds no module, so that modules may move, and no alias of a type, so that what counts is
what may be given and what is returned: of the clients' own types their keys, fields and members
follow behind the calls.
"""

import dataclasses
import inspect
import sys
import types
from collections.abc import Callable, Collection, Iterator
from enum import Enum
from itertools import count
from typing import (
    Annotated,
    Any,
    Literal,
    NotRequired,
    Required,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
    is_typeddict,
)

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant.management.declaration import Request
from openpendant.simplemsg.pendant.management.recordings import PlaybackAccount
from openpendant.tools.pendants.client import MotionHandle, PendantClient, PlaybackHandle
from openpendant.tools.pendants.loop_thread import LoopThread
from openpendant.tools.pendants.sync_client import SyncMotion, SyncPendantClient, SyncPlayback

OURS = "openpendant."

BEGUN: dict[str, type] = {
    "PendantClient.programs.run": MotionHandle,
    "PendantClient.recordings.play": PlaybackHandle,
    "SyncPendantClient.programs.run": SyncMotion,
    "SyncPendantClient.recordings.play": SyncPlayback,
}
"""What the calls return that make something else of another call's result."""


HANDED_OUT = (PlaybackAccount,)
"""Types of attributes that an object gets when it is made, which no class names."""


class Calls:
    """Collects lines, and the types that occur in them."""

    def __init__(self) -> None:
        self._named: dict[str, type] = {}
        self._told: set[str] = set()

    def lines(self) -> list[str]:
        background = PendantClient()
        # It has no connection, and nothing is called.
        blocking = SyncPendantClient(cast(LoopThread, None), background)
        found = [*self._of_client(background), "", *self._of_client(blocking)]
        for kind in HANDED_OUT:
            self._named_as(kind)
        while rest := sorted(self._named.keys() - self._told):
            self._told.update(rest)
            for name in rest:
                found += ["", *self._of_type(name, self._named[name])]
        return found

    def _of_client(self, client: object) -> Iterator[str]:
        kind = type(client)
        self._told.add(kind.__name__)
        groups = {
            name: value
            for name, value in sorted(vars(client).items())
            if not name.startswith("_")
            and type(value).__module__.startswith(OURS)
            and value.__class__ is not PendantClient
        }
        is_async = isinstance(client, PendantClient)
        yield f"class {kind.__name__}"
        yield from self._of_members(kind, client, kind.__name__, is_async)
        for group, value in groups.items():
            yield from self._of_members(type(value), value, f"{kind.__name__}.{group}", is_async)

    def _of_type(self, name: str, kind: type) -> Iterator[str]:
        if is_typeddict(kind):
            yield f"keys of {name}"
            hints = get_type_hints(kind, include_extras=True)
            required: frozenset[str] = kind.__required_keys__  # type: ignore[attr-defined]
            for key, hint in hints.items():
                yield f"  {key}{'' if key in required else '?'}: {self._spelled(hint)}"
        elif issubclass(kind, Enum):
            yield f"members of {name}"
            yield from (f"  {member.name} = {member.value!r}" for member in kind)
        elif dataclasses.is_dataclass(kind):
            yield f"fields of {name}"
            for each in dataclasses.fields(kind):
                yield f"  {each.name}: {self._spelled(_field_hint(kind, each.name))}"
            if not issubclass(kind, Message):
                fields = {each.name for each in dataclasses.fields(kind)}
                yield from self._of_members(kind, None, name, leave_out=fields)
        else:
            yield f"class {name}"
            yield from self._of_members(kind, None, name)

    def _of_members(
        self,
        kind: type,
        made: object | None,
        path: str,
        is_async: bool = False,
        leave_out: Collection[str] = (),
    ) -> Iterator[str]:
        of_object = {} if made is None else vars(made)
        names = {name for name in dir(kind) if not name.startswith("_")} | set(of_object)
        hints = get_type_hints(kind)
        for name in sorted(names | hints.keys()):
            if name.startswith("_") or name in leave_out:
                continue
            about = inspect.getattr_static(kind, name, None)
            where = f"{path}.{name}"
            if isinstance(about, property):
                assert about.fget is not None
                yield f"  {where} -> {self._spelled(get_type_hints(about.fget).get('return'))}"
            elif isinstance(about, classmethod):
                if LoopThread not in get_type_hints(about.__func__).values():
                    yield f"  classmethod {self._call(where, about.__func__, is_async)}"
            elif about is not None or callable(of_object.get(name)):
                call = about if inspect.isfunction(about) else getattr(made or kind, name)
                yield f"  {self._call(where, call, is_async)}"
            elif name in hints:
                yield f"  {where}: {self._spelled(hints[name])}"
            else:
                yield f"  {where}"

    def _call(self, where: str, call: Callable[..., Any], is_async: bool) -> str:
        hints = get_type_hints(call)
        returned = hints.get("return")
        is_request = get_origin(returned) is Request
        is_awaited = is_async if is_request else inspect.iscoroutinefunction(call)
        if where in BEGUN:
            told, is_awaited = self._named_as(BEGUN[where]), is_async
        else:
            told = self._spelled(get_args(returned)[0] if is_request else returned)
        arguments = self._arguments(call, hints)
        return f"{'async ' if is_awaited else ''}{where}({arguments}) -> {told}"

    def _arguments(self, call: Callable[..., Any], hints: dict[str, Any]) -> str:
        told: list[str] = []
        kinds = inspect.Parameter
        is_keyword_only = False
        for each in inspect.signature(call).parameters.values():
            if each.name in ("self", "cls"):
                continue
            if each.kind is kinds.KEYWORD_ONLY and not is_keyword_only:
                is_keyword_only = True
                told.append("*")
            star = ""
            if each.kind in (kinds.VAR_POSITIONAL, kinds.VAR_KEYWORD):
                star = "*" if each.kind is kinds.VAR_POSITIONAL else "**"
            is_keyword_only |= each.kind is kinds.VAR_POSITIONAL
            text = f"{star}{each.name}: {self._spelled(hints.get(each.name, Any))}"
            if each.default is not each.empty:
                text += f" = {_value(each.default)}"
            told.append(text)
            if each.kind is kinds.POSITIONAL_ONLY:
                told.append("/")
        return ", ".join(told)

    def _spelled(self, hint: Any) -> str:
        """Return a type without modules and aliases, and remember it where it is ours."""
        origin, arguments = get_origin(hint), get_args(hint)
        match hint:
            case None | types.NoneType:
                return "None"
            case TypeVar():
                return hint.__name__
            case _ if hint is Ellipsis:
                return "..."
            case list():
                return f"[{', '.join(map(self._spelled, hint))}]"
        if origin in (Union, types.UnionType):
            return " | ".join(map(self._spelled, arguments))
        if origin in (Annotated, NotRequired, Required):
            return self._spelled(arguments[0])
        if origin is Literal:
            return f"Literal[{', '.join(map(_value, arguments))}]"
        if origin is not None:
            return f"{self._named_as(origin)}[{', '.join(map(self._spelled, arguments))}]"
        return self._named_as(hint)

    def _named_as(self, kind: Any) -> str:
        name: str = getattr(kind, "__name__", "") or str(kind).rpartition(".")[2]
        if not isinstance(kind, type) or not kind.__module__.startswith(OURS):
            return name
        # Several types may have one name; they are numbered in the order in which they occur.
        for number in count(1):
            numbered = name if number == 1 else f"{name}#{number}"
            if self._named.setdefault(numbered, kind) is kind:
                return numbered
        raise AssertionError("there are always more numbers")


def _field_hint(kind: type, name: str) -> Any:
    """Return the type of one field; not all annotations of a message can be evaluated."""
    (owner,) = [base for base in kind.__mro__ if name in vars(base).get("__annotations__", {})][:1]
    hint = owner.__annotations__[name]
    return eval(hint, vars(sys.modules[owner.__module__])) if isinstance(hint, str) else hint


def _value(value: object) -> str:
    if isinstance(value, Enum):
        return f"{type(value).__name__}.{value.name}"
    return repr(value)
