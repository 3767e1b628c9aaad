"""The calls of both Python clients are today as they were: arguments, types, what is returned."""

import difflib

from frozen.client_calls import Calls
from frozen.frozen_files import SIGNATURES


def test_every_call_of_the_clients_is_as_it_was() -> None:
    then = SIGNATURES.read_text("utf-8").splitlines()
    found = list(difflib.unified_diff(then, Calls().lines(), "then", "now", lineterm="", n=0))
    assert not found, "\n".join(found)
