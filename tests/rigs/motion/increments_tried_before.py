"""Homes of the project's robots whose first increments are not tried again.

Promise 44 tries each of them on each robot, which takes seconds. What a test sees here is the
report that it would see anyway, as long as that promise's tests pass.
"""

import pytest

from openpendant.motion.robot_report import home_check


def take_increments_as_accepted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the check of a home accept every increment; all else of it is done."""
    monkeypatch.setattr(home_check, "_refusal", lambda *_: iter(()))
