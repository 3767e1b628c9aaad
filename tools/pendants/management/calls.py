"""How a declared management operation becomes a call of both clients.

A group of operations is a class whose attributes are `call(SomeRequest)`. In a group of the asyncio
client (`AsyncCalls`) such a call is awaited, in one of the blocking client (`SyncCalls`) it waits;
either way it takes the fields of the request and returns the server's reply. Knows no operation.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import MISSING, Field, fields
from functools import cached_property, wraps
from inspect import Parameter, Signature
from keyword import iskeyword
from types import GenericAlias
from typing import Any, Generic, ParamSpec, TypeVar, get_type_hints, overload

from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.declaration import Request, body_of

from ..loop_thread import LoopThread

Reply = TypeVar("Reply")
_Arguments = ParamSpec("_Arguments")
_Made = TypeVar("_Made")
_Used = TypeVar("_Used")
_Group = TypeVar("_Group")

Manage = Callable[[dict[str, Any]], Awaitable[dict[str, Any]]]
"""Sends a management request and returns the reply's body: `PendantClient.manage`."""


def then(
    make: Callable[_Arguments, _Made], use: Callable[[_Made], _Used]
) -> Callable[_Arguments, _Used]:
    """Return a call with the arguments of `make` that does with its result what `use` does."""

    @wraps(make)
    def asked(*arguments: _Arguments.args, **named: _Arguments.kwargs) -> _Used:
        return use(make(*arguments, **named))

    return asked


class AsyncCalls:
    """The way of the asyncio client: calls are awaited."""

    def __init__(self, manage: Manage) -> None:
        self._manage = manage

    async def perform(self, request: Request[Any], part: str) -> Any:
        """Send a request; return the reply, or that field of it."""
        reply = await self._manage(body_of(request))
        return reply[part] if part else reply


class SyncCalls:
    """The way of the blocking client: calls wait for a thread that has the connection."""

    def __init__(self, thread: LoopThread, manage: Manage) -> None:
        self._thread = thread
        self._calls = AsyncCalls(manage)

    def perform(self, request: Request[Any], part: str) -> Any:
        """Send a request; return the reply, or that field of it."""
        return self._thread.call(self._calls.perform(request, part))


Way = TypeVar("Way", bound=AsyncCalls | SyncCalls)


class CallGroup(Generic[Way]):
    """Calls of operations, in the way of one client."""

    def __init__(self, way: Way) -> None:
        self._way = way


class call(Generic[_Arguments, Reply]):
    """Makes a declared request a call that asks the server and returns its reply.

    Attributes:
        part: the only field of the reply that is returned; empty for all of it.
    """

    @overload
    def __init__(self, kind: Callable[_Arguments, Request[Reply]]) -> None: ...
    @overload
    def __init__(self, kind: Callable[_Arguments, Request[Any]], part: str) -> None: ...

    def __init__(self, kind: Callable[_Arguments, Request[Any]], part: str = "") -> None:
        self.kind = kind
        self.part = part

    @cached_property
    def request(self) -> Callable[_Arguments, Request[Any]]:
        """Function that makes the request, with the arguments and the words of the call."""
        # Made when it is asked for: a program that only moves the robot starts without it.
        return function_of(self.kind, self.part)

    @overload
    def __get__(self, group: None, owner: type) -> call[_Arguments, Reply]: ...
    @overload
    def __get__(
        self, group: CallGroup[AsyncCalls], owner: type
    ) -> Callable[_Arguments, Coroutine[Any, Any, Reply]]: ...
    @overload
    def __get__(self, group: CallGroup[SyncCalls], owner: type) -> Callable[_Arguments, Reply]: ...

    def __get__(self, group: CallGroup[Any] | None, owner: type) -> Any:
        """Return the call of one client; of the class itself, what makes calls."""
        if group is None:
            return self

        @wraps(self.request)
        def asked(*arguments: _Arguments.args, **named: _Arguments.kwargs) -> Any:
            return group._way.perform(self.request(*arguments, **named), self.part)

        return asked


def calls_of(topic: str) -> Callable[[type[_Group]], type[_Group]]:
    """Give a group a call for each operation of its topic that it has no line for.

    A line in the class gives a call its type; an operation without one is there all the same.
    """

    def complete(group: type[_Group]) -> type[_Group]:
        lines = {each.kind for each in vars(group).values() if isinstance(each, call)}
        for name, kind in OPERATIONS.items():
            begins, _, rest = name.partition(".")
            if begins == topic and kind not in lines:
                setattr(group, f"{rest}_" if iskeyword(rest) else rest, call(kind))
        return group

    return complete


def function_of(
    kind: Callable[_Arguments, Request[Reply]], part: str = ""
) -> Callable[_Arguments, Request[Reply]]:
    """Return a function that makes a declared request, and is documented as the call is.

    Args:
        part: the only field of the reply that the call returns; empty for all of it.
    """
    assert isinstance(kind, type)
    assert issubclass(kind, Request)

    def made(*arguments: _Arguments.args, **named: _Arguments.kwargs) -> Request[Reply]:
        request: Request[Reply] = kind(*arguments, **named)
        return request

    told = [each for each in fields(kind) if each.name != "op"]
    ordered = [each for each in told if not each.kw_only] + [each for each in told if each.kw_only]
    hints = get_type_hints(kind)
    reply = get_type_hints(kind.reply())[part] if part else kind.reply()
    made.__doc__ = kind.__doc__
    made.__name__ = made.__qualname__ = kind.__name__
    made.__annotations__ = {each.name: hints[each.name] for each in ordered}
    made.__annotations__["return"] = GenericAlias(Request, (reply,))
    vars(made)["__signature__"] = Signature([_parameter(each) for each in ordered])
    return made


def _parameter(told: Field[Any]) -> Parameter:
    default = told.default if told.default_factory is MISSING else told.default_factory()
    kind = Parameter.KEYWORD_ONLY if told.kw_only else Parameter.POSITIONAL_OR_KEYWORD
    return Parameter(told.name, kind, default=Parameter.empty if default is MISSING else default)
