"""The connections between the server and a robot controller."""

from __future__ import annotations

from enum import Enum


class ControllerPath(Enum):
    """What a connection to the controller is for."""

    MOTION = "points and their answers"
    STATE = "its reports"
    STOP = "a second motion connection for nothing but STOP"
