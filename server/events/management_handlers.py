"""Handlers of management requests: methods of services, found by the request they are for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias, TypeVar

from openpendant.simplemsg.pendant.management.declaration import Request

from .effects import Effect
from .reply_to import ReplyTo

_Service = TypeVar("_Service")
_Asked = TypeVar("_Asked", bound=Request[Any])
_Reply = TypeVar("_Reply")

Handler: TypeAlias = Callable[[Any, ReplyTo[Any], int], list[Effect]]
"""Carries out a request at a time [ns]; the answer may come later."""

Handlers: TypeAlias = Mapping[type[Request[Any]], Handler]

_Method: TypeAlias = Callable[[_Service, _Asked, ReplyTo[_Reply], int], list[Effect]]


def handles(
    kind: Callable[..., Request[_Reply]],
) -> Callable[[_Method[_Service, _Asked, _Reply]], _Method[_Service, _Asked, _Reply]]:
    """Declare a method as the one that carries out requests of a kind.

    Args:
        kind: class of the request; what the method answers has to be of its reply's type.
    """

    def marked(
        method: _Method[_Service, _Asked, _Reply],
    ) -> _Method[_Service, _Asked, _Reply]:
        vars(method)["handles"] = kind
        return method

    return marked


def handlers_of(*services: object) -> dict[type[Request[Any]], Handler]:
    """Return the handlers of some services by the class of the request.

    Raises:
        ValueError: two handlers are for one request.
    """
    found: dict[type[Request[Any]], Handler] = {}
    for service in services:
        for name, method in vars(type(service)).items():
            kind = getattr(method, "handles", None)
            if kind is None:
                continue
            if kind in found:
                raise ValueError(f"{kind.__name__} has two handlers, one of them {name}")
            found[kind] = getattr(service, name)
    return found
