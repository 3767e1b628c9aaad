import pytest
from rigs.cells.controller_rig import ControllerRig


@pytest.fixture
def rig() -> ControllerRig:
    return ControllerRig()
