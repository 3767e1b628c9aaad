import pytest
from rigs.motion.loaded_robots import arm, serial_robot

from openpendant.motion.description.robot import SerialRobot
from openpendant.motion.kinematics.serial import Kinematics


@pytest.fixture
def kinematics(name: str) -> Kinematics:
    """Those of the arm that the test's table names."""
    return arm(name)


@pytest.fixture
def robot(name: str) -> SerialRobot:
    """The arm that the test's table names."""
    return serial_robot(name)
