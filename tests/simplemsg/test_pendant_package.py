"""The modules of the pendant messages: nothing that one declares is left out of the package."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator
from enum import Enum

from openpendant.simplemsg import pendant
from openpendant.simplemsg.declaration import Message, Record
from openpendant.simplemsg.pendant import roles


def declared() -> Iterator[type]:
    for found in pkgutil.iter_modules(pendant.__path__, f"{pendant.__name__}."):
        module = importlib.import_module(found.name)
        for value in vars(module).values():
            if isinstance(value, type) and value.__module__ == module.__name__:
                yield value


def test_every_message_that_a_module_declares_is_in_the_list_once() -> None:
    messages = [each for each in declared() if issubclass(each, Message)]
    assert len(messages) == len(pendant.PENDANT_MESSAGES)
    assert set(messages) == set(pendant.PENDANT_MESSAGES)


def test_every_message_record_and_closed_set_is_imported_from_the_package() -> None:
    # Who may do what is told by no message, but by the operations and the server's tables.
    found = [each for each in declared() if each.__module__ != roles.__name__]
    names = {each.__name__ for each in found if issubclass(each, Record | Enum)}
    assert names <= set(pendant.__all__)
    assert all(getattr(pendant, name).__module__.startswith(pendant.__name__) for name in names)
