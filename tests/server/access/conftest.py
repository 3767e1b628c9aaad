import pytest
from rigs.cells.guarded_rig import GuardedRig
from rigs.peers.server_clients import Pendant


@pytest.fixture
def rig() -> GuardedRig:
    return GuardedRig()


@pytest.fixture
def otto(rig: GuardedRig) -> Pendant:
    """An operator who has logged in and taken the authority."""
    pendant = rig.user("otto")
    pendant.take()
    return pendant
