from __future__ import annotations

import pytest
from rigs.cells.guarded_rig import GuardedRig


@pytest.fixture
def rig() -> GuardedRig:
    return GuardedRig()
