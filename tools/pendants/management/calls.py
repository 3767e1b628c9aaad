"""How one definition of a management operation becomes a call of both clients.

A group of operations is a class whose methods return a `Request`. Bound to the asyncio client
(`AsyncCalls`) such a method is awaited, bound to the blocking one (`SyncCalls`) it waits; either
way it returns the server's reply. Knows no operation.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine, Mapping
from dataclasses import dataclass
from functools import wraps
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

from ..loop_thread import LoopThread

Reply = TypeVar("Reply")
_Arguments = ParamSpec("_Arguments")
_Made = TypeVar("_Made")
_Used = TypeVar("_Used")

Manage = Callable[[dict[str, Any]], Awaitable[dict[str, Any]]]
"""Sends a management request and returns the reply's body: `PendantClient.manage`."""


@dataclass(frozen=True, slots=True)
class Request(Generic[Reply]):
    """One management request.

    Attributes:
        op: name of the operation.
        fields: by their names in the protocol.
        part: the only field of the reply that is returned; empty for all of it.
    """

    op: str
    fields: Mapping[str, Any]
    part: str = ""

    @property
    def body(self) -> dict[str, Any]:
        """The JSON object that is sent."""
        return {"op": self.op, **self.fields}

    def read(self, reply: Mapping[str, Any]) -> Any:
        """Return what the caller gets of the server's reply."""
        return reply[self.part] if self.part else reply


def asks(op: str, /, **fields: Any) -> Request[Any]:
    """Return the request for an operation."""
    return Request(op, fields)


def then(
    make: Callable[_Arguments, _Made], use: Callable[[_Made], _Used]
) -> Callable[_Arguments, _Used]:
    """Return a call with the arguments of one function that does with its result what another does.

    Args:
        make: makes a request.
        use: sends it.
    """

    @wraps(make)
    def asked(*arguments: _Arguments.args, **named: _Arguments.kwargs) -> _Used:
        return use(make(*arguments, **named))

    return asked


class AsyncCalls:
    """Operations that are awaited."""

    def __init__(self, manage: Manage) -> None:
        """Make the group of one client.

        Args:
            manage: sends a request.
        """
        self._manage = manage

    async def _perform(self, request: Request[Any]) -> Any:
        return request.read(await self._manage(request.body))


class SyncCalls:
    """Operations that wait."""

    def __init__(self, thread: LoopThread, manage: Manage) -> None:
        """Make the group of one client.

        Args:
            thread: has the connection.
            manage: sends a request, on that thread.
        """
        self._thread = thread
        self._manage = manage

    def _perform(self, request: Request[Any]) -> Any:
        return request.read(self._thread.call(self._sent(request)))

    async def _sent(self, request: Request[Any]) -> dict[str, Any]:
        return await self._manage(request.body)


class call(Generic[_Arguments, Reply]):
    """Makes a method that returns a request one that asks the server and returns its reply."""

    def __init__(self, request: Callable[Concatenate[Any, _Arguments], Request[Reply]]) -> None:
        """Take the method that makes the request."""
        self.request = request

    @overload
    def __get__(
        self, group: None, owner: type
    ) -> Callable[Concatenate[Any, _Arguments], Request[Reply]]: ...
    @overload
    def __get__(
        self, group: AsyncCalls, owner: type
    ) -> Callable[_Arguments, Coroutine[Any, Any, Reply]]: ...
    @overload
    def __get__(self, group: SyncCalls, owner: type) -> Callable[_Arguments, Reply]: ...

    def __get__(self, group: AsyncCalls | SyncCalls | None, owner: type) -> Callable[..., Any]:
        """Return the call of one client; of the class itself, the method as it was written."""
        if group is None:
            return self.request

        @wraps(self.request)
        def asked(*arguments: _Arguments.args, **named: _Arguments.kwargs) -> Any:
            return group._perform(self.request(group, *arguments, **named))

        return asked
