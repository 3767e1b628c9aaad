"""Catalogue of the Motoman dialect: the meaning of each number, and what helps.

Apart from the numbers themselves, so that decoding messages need not load these texts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from .motoman import IoResult, MotionCommand, MotionResult, Subcode
from .verdicts import CatalogueEntry


@dataclass(frozen=True, slots=True)
class Explanation:
    """Explanation of a motion reply for the person who reads it."""

    name: str
    meaning: str
    remedy: str


_NOTHING = "Nothing to do."
_REPORT = "Report it, with a recording."

COMMANDS: dict[MotionCommand, CatalogueEntry] = {
    MotionCommand.CHECK_MOTION_READY: CatalogueEntry(
        "Asks whether points would be taken: result 0, or 2 with a reason from 5000 up.",
        "Not ready: follow the reason, then START_TRAJ_MODE.",
    ),
    MotionCommand.CHECK_QUEUE_CNT: CatalogueEntry(
        "Asks how many increments of a group are queued; the subcode is that number.",
        "Result 2 with subcode -1: name a group that the controller has.",
    ),
    MotionCommand.STOP_MOTION: CatalogueEntry(
        "Stops all groups at once, without a ramp, and empties their queues.",
        "Refused: the queues did not come to rest in 20 ms; send it again.",
    ),
    MotionCommand.START_SERVOS: CatalogueEntry(
        "Switches the drives on; answered within 5 s.",
        "Refused: clear alarm, emergency stop and hold first.",
    ),
    MotionCommand.STOP_SERVOS: CatalogueEntry(
        "Stops motion and switches the drives off; answered within 5 s.", "Refused: send it again."
    ),
    MotionCommand.RESET_ALARM: CatalogueEntry(
        "Clears the active alarm and error.", "Refused: clear the alarm at the teach pendant."
    ),
    MotionCommand.START_TRAJ_MODE: CatalogueEntry(
        "Clears errors, switches the drives on and starts the job INIT_ROS; then points are taken.",
        "Refused: follow the reason; emergency stop, hold and remote need a person.",
    ),
    MotionCommand.STOP_TRAJ_MODE: CatalogueEntry(
        "Ends the job; refused while increments are queued.", "Refused: send STOP_MOTION first."
    ),
    MotionCommand.DISCONNECT: CatalogueEntry(
        "Ends the job and closes the connection, without a reply where that succeeds.",
        "Refused: send STOP_MOTION first.",
    ),
}

RESULTS: dict[MotionResult, CatalogueEntry] = {
    MotionResult.SUCCESS: CatalogueEntry("The request was carried out; yes.", _NOTHING),
    MotionResult.BUSY: CatalogueEntry(
        "The group still converts the point before.", "Send the same point again, some 5 ms later."
    ),
    MotionResult.FAILURE: CatalogueEntry(
        "The request was not carried out; no.", "Follow the reason; read the controller's status."
    ),
    MotionResult.INVALID: CatalogueEntry("The request was refused as wrong.", "Follow the reason."),
    MotionResult.ALARM: CatalogueEntry(
        "An alarm is active; MotoROS 1.9.12 never sends this.", "Reset the alarm."
    ),
    MotionResult.NOT_READY: CatalogueEntry(
        "The controller takes no motion now.", "Follow the reason, then START_TRAJ_MODE."
    ),
    MotionResult.MP_FAILURE: CatalogueEntry(
        "A call of the controller's system failed; MotoROS 1.9.12 never sends this.", _REPORT
    ),
}

SUBCODES: dict[Subcode, CatalogueEntry] = {
    Subcode.INVALID_UNSPECIFIED: CatalogueEntry("Wrong, without a reason given.", _REPORT),
    Subcode.INVALID_MESSAGE_SIZE: CatalogueEntry(
        "Fewer bytes came at once than the message has; they were thrown away.",
        "Send each frame with one write, and none before the reply to the one before.",
    ),
    Subcode.INVALID_HEADER: CatalogueEntry(
        "The header breaks a rule.", "See the rules of the header."
    ),
    Subcode.INVALID_MESSAGE_TYPE: CatalogueEntry(
        "This port does not take this message type.",
        "Send motion to port 50240, registers to port 50242.",
    ),
    Subcode.INVALID_GROUP: CatalogueEntry(
        "The controller has no group of this number.", "Count groups from 0."
    ),
    Subcode.INVALID_SEQUENCE: CatalogueEntry(
        "The sequence is negative; special sequences are not understood.",
        "Count points from 0; stop with STOP_MOTION.",
    ),
    Subcode.INVALID_COMMAND: CatalogueEntry(
        "The command of a MOTION_CTRL is unknown; MotoROS 1.9.12 repeats its last reply instead.",
        "Send a command of the table.",
    ),
    Subcode.INVALID_DATA: CatalogueEntry("A value is outside what it may be.", "Check the values."),
    Subcode.INVALID_START_POSITION: CatalogueEntry(
        "Point 0 is more than 30 pulses away from the commanded position.",
        "Start where the robot is commanded to be; read the joint feedback again.",
    ),
    Subcode.INVALID_POSITION: CatalogueEntry(
        "A position is out of range.", "Keep to the joint limits."
    ),
    Subcode.INVALID_SPEED: CatalogueEntry(
        "A velocity is above the axis' largest speed.", "Allow the motion more time."
    ),
    Subcode.INVALID_ACCELERATION: CatalogueEntry(
        "An acceleration is above the axis' largest.", "Allow the motion more time."
    ),
    Subcode.INVALID_INSUFFICIENT_FIELDS: CatalogueEntry(
        "A point lacks time, position or velocity.", "Send all three and set their bits, 7."
    ),
    Subcode.INVALID_TIME: CatalogueEntry(
        "The time of a point is 14,400 s or more.", "Split the trajectory."
    ),
    Subcode.INVALID_TOOL: CatalogueEntry(
        "No tool file has this number.", "Select a tool from 0 to 63."
    ),
    Subcode.NOT_READY_UNSPECIFIED: CatalogueEntry(
        "Not ready, without a reason given.", "Send START_TRAJ_MODE."
    ),
    Subcode.NOT_READY_ALARM: CatalogueEntry(
        "An alarm is active.", "Clear its cause; send RESET_ALARM."
    ),
    Subcode.NOT_READY_ERROR: CatalogueEntry("An error is active.", "Clear it; send RESET_ALARM."),
    Subcode.NOT_READY_EMERGENCY_STOP: CatalogueEntry(
        "An emergency stop is active.", "A person releases it at the machine."
    ),
    Subcode.NOT_READY_NOT_IN_PLAY: CatalogueEntry(
        "The key switch does not stand on PLAY.", "Turn it to REMOTE."
    ),
    Subcode.NOT_READY_NOT_REMOTE: CatalogueEntry(
        "The key switch does not stand on REMOTE.", "Turn it to REMOTE."
    ),
    Subcode.NOT_READY_SERVO_OFF: CatalogueEntry(
        "The drives are off.", "Send START_SERVOS or START_TRAJ_MODE."
    ),
    Subcode.NOT_READY_HOLD: CatalogueEntry("Hold is active.", "Release it at the controller."),
    Subcode.NOT_READY_JOB_NOT_STARTED: CatalogueEntry(
        "The job INIT_ROS does not run.", "Send START_TRAJ_MODE."
    ),
    Subcode.NOT_READY_NOT_WAITING: CatalogueEntry(
        "The job has not come to where it waits for points.",
        "Send START_TRAJ_MODE; check that no other job holds the controller.",
    ),
    Subcode.NOT_READY_SKILLSEND: CatalogueEntry(
        "The job has not reached its SKILLSEND (DX100).", "Send START_TRAJ_MODE."
    ),
    Subcode.NOT_READY_PFL_ACTIVE: CatalogueEntry(
        "Power and force limiting stopped the robot.", "Clear the contact; send START_TRAJ_MODE."
    ),
    Subcode.NOT_READY_INCREMENT_REJECTED: CatalogueEntry(
        "The controller rejected an increment, such as one beyond a soft limit.",
        "Send START_TRAJ_MODE, then a trajectory inside the limits.",
    ),
}

IO_RESULTS: dict[IoResult, CatalogueEntry] = {
    IoResult.SUCCESS: CatalogueEntry("Read or written.", _NOTHING),
    IoResult.READ_ADDRESS_INVALID: CatalogueEntry(
        "This address cannot be read.", "See the address ranges of the controller."
    ),
    IoResult.WRITE_ADDRESS_INVALID: CatalogueEntry(
        "This address cannot be written.", "See which address ranges may be written."
    ),
    IoResult.WRITE_VALUE_INVALID: CatalogueEntry(
        "The value does not fit.", "A bit takes 0 and 1, a group up to 255, a register up to 65535."
    ),
    IoResult.READ_API_ERROR: CatalogueEntry("The controller failed to read.", _REPORT),
    IoResult.WRITE_API_ERROR: CatalogueEntry("The controller failed to write.", _REPORT),
}

CATALOGUE: dict[type[IntEnum], Mapping[Any, CatalogueEntry]] = {
    MotionCommand: COMMANDS,
    MotionResult: RESULTS,
    Subcode: SUBCODES,
    IoResult: IO_RESULTS,
}
"""Meaning and remedy of every number, by its enumeration; a test demands that none is missing."""


def explain(command: int, result: int, subcode: int) -> Explanation:
    """Return the meaning of a MOTION_REPLY's three numbers in words.

    Args:
        command: of the reply; a message type where it answers no MOTION_CTRL.
        subcode: of the reply; a count, and no reason, where the command is CHECK_QUEUE_CNT.
    """
    try:
        known = MotionResult(result)
    except ValueError:
        return Explanation(f"result {result}", "This result is unknown.", _REPORT)
    entry, name = RESULTS[known], known.name
    if command == MotionCommand.CHECK_QUEUE_CNT:
        if known is MotionResult.SUCCESS:
            return Explanation(name, f"{subcode} increments of the group are queued.", _NOTHING)
        return Explanation(name, entry.cause, COMMANDS[MotionCommand.CHECK_QUEUE_CNT].remedy)
    reason = next((one for one in Subcode if one == subcode), None)
    if known is not MotionResult.SUCCESS and reason is not None:
        entry, name = SUBCODES[reason], f"{name}/{reason.name}"
    return Explanation(name, entry.cause, entry.remedy)
