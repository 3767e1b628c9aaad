"""Construction of a controller from its settings.

The only module that knows both the robot's file and the core.
"""

from __future__ import annotations

from openpendant.motion.description.robot import SerialRobot, serial_robot
from openpendant.simplemsg import MsgType

from ..core.admission import Admission, Tolerances
from ..core.controller import EmulatedController
from ..core.referee import Referee
from ..core.signals import DigitalSignals
from ..float32 import NANOSECONDS
from ..interpolation.servo import StartRule
from ..profiles import PROFILES, ControllerProfile
from .settings import EmulatorSettings


def build_controller(settings: EmulatorSettings, now: int) -> EmulatedController:
    """Return a controller that stands at its start position.

    Raises:
        MotionError: the robot is unknown or its file faulty, or the start position is outside its
            range or has the wrong number of joints.
    """
    robot = serial_robot(settings.robot)
    limits = robot.limits
    tolerances = Tolerances(
        interpolation=settings.interpolation_margin, start=settings.start_tolerance
    )
    return EmulatedController(
        Admission(limits, tolerances),
        start_position(settings, robot),
        _profile(settings),
        buffer_depth=settings.buffer,
        start_rule=StartRule(
            points=settings.start_points,
            lead=round(settings.start_lead * NANOSECONDS),
            wait=round(settings.start_wait * NANOSECONDS),
            patience=round(settings.start_patience * NANOSECONDS),
        ),
        is_strict=settings.strict_sequence,
        operator_events=settings.operator_events,
        signals=DigitalSignals(settings.inputs, settings.outputs),
        referee=Referee(settings.violations_kept),
        now=now,
    )


def _profile(settings: EmulatorSettings) -> ControllerProfile:
    """Return the vendor's behaviour, without the messages that were switched off."""
    profile = PROFILES[settings.profile]
    if settings.joint_feedback:
        return profile
    state = tuple(kind for kind in profile.state if kind is not MsgType.JOINT_FEEDBACK)
    return profile._replace(state=state)


def start_position(settings: EmulatorSettings, robot: SerialRobot) -> tuple[float, ...]:
    """Return where the robot stands at first, controller side [rad or m].

    Raises:
        MotionError: the position is outside the range or has the wrong number of joints.
    """
    match settings.start:
        case "home":
            position = robot.home_position
        case "zero":
            position = (0.0,) * robot.dof
        case values:
            position = tuple(values)
    robot.limits.check_position(position)
    return position
