"""I/O bits and registers of a Motoman controller, and the rule which of them may be written.

Source: ros-industrial/motoman, `MotoPlus/IoServer.c` of MotoROS 1.9.12. Bit addresses are decimal:
the last digit is the bit, 0 to 7, of the group that the other digits number.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from .motoman import IoResult

REGISTER_OFFSET = 1_000_000
"""Number that the controller adds to a smaller register number to make an address."""

REGISTERS = range(1_000)
"""Numbers of the M registers, all of which can be read."""

WRITABLE_REGISTERS = range(560)
"""Numbers of the M registers that can be written."""

_BITS_OF_A_GROUP = 8
_LARGEST = {"bit": 1, "group": 255, "register": 65_535}


class ControllerModel(Enum):
    """Models of the controller."""

    DX100 = "DX100"
    FS100 = "FS100"
    DX200 = "DX200"
    YRC1000 = "YRC1000"
    YRC1000MICRO = "YRC1000micro"


@dataclass(frozen=True, slots=True)
class Area:
    """A range of bit addresses with one purpose."""

    name: str
    first: int
    last: int
    writable: bool = False


_NAMES = {
    "general input": False,
    "general output": True,
    "external input": False,
    "network input": True,
    "external output": False,
    "network output": False,
    "specific input": False,
    "specific output": False,
    "interface panel": True,
    "auxiliary relay": False,
    "control status": False,
    "pseudo input": False,
}

_SAME = ((60010, 60647), (70010, 79997))

_DX100 = (
    *((10, 2567), (10010, 12567), (20010, 22567), (25010, 27567), (30010, 32567), (35010, 37567)),
    *((40010, 41607), (50010, 52007), *_SAME, (80010, 80647), (82010, 82207)),
)
_FS100 = (
    *((10, 1287), (10010, 11287), (20010, 21287), (25010, 26287), (30010, 31287), (35010, 36287)),
    *((40010, 41607), (50010, 52007), *_SAME, (80010, 80647), (82010, 82207)),
)
_DX200 = (
    *((10, 5127), (10010, 15127), (20010, 25127), (27010, 29567), (30010, 35127), (37010, 39567)),
    *((40010, 41607), (50010, 53007), *_SAME, (80010, 82007), (82010, 82207)),
)
_YRC1000 = (
    *((10, 5127), (10010, 15127), (20010, 25127), (27010, 29567), (30010, 35127), (37010, 39567)),
    *((40010, 42567), (50010, 55127), *_SAME, (80010, 85127), (87010, 87207)),
)
_YRC1000MICRO = (
    *((10, 5127), (10010, 15127), (20010, 21287), (27010, 29567), (30010, 31287), (37010, 39567)),
    *((40010, 42567), (50010, 55127), *_SAME, (80010, 85127), (87010, 87207)),
)

AREAS: dict[ControllerModel, tuple[Area, ...]] = {
    controller: tuple(
        Area(name, first, last, writable)
        for (name, writable), (first, last) in zip(_NAMES.items(), ranges, strict=True)
    )
    for controller, ranges in {
        ControllerModel.DX100: _DX100,
        ControllerModel.FS100: _FS100,
        ControllerModel.DX200: _DX200,
        ControllerModel.YRC1000: _YRC1000,
        ControllerModel.YRC1000MICRO: _YRC1000MICRO,
    }.items()
}
"""Every range of bit addresses of each model, lowest first."""


def area_of(controller: ControllerModel, bit: int) -> Area | None:
    """Return the range that holds a bit address, None where there is no such bit."""
    if bit % 10 >= _BITS_OF_A_GROUP:
        return None
    for area in AREAS[controller]:
        if area.first <= bit <= area.last:
            return area
    return None


def bits_of_group(group: int) -> range:
    """Return the bit addresses of a group, lowest bit first."""
    return range(group * 10, group * 10 + _BITS_OF_A_GROUP)


def register_number(address: int) -> int:
    """Return the number of an M register that a client named by number or by address."""
    return address - REGISTER_OFFSET if address >= REGISTER_OFFSET else address


def judge_bit(controller: ControllerModel, bit: int, value: int | None = None) -> IoResult:
    """Return the verdict on reading a bit, or on writing it where a value is given."""
    return _judge(area_of(controller, bit), value, _LARGEST["bit"])


def judge_group(controller: ControllerModel, group: int, value: int | None = None) -> IoResult:
    """Return the verdict on reading eight bits, or on writing them where a value is given."""
    return _judge(area_of(controller, group * 10), value, _LARGEST["group"])


def judge_register(address: int, value: int | None = None) -> IoResult:
    """Return the verdict on reading an M register, or on writing it where a value is given."""
    number = register_number(address)
    register = Area("M register", number, number, number in WRITABLE_REGISTERS)
    return _judge(register if number in REGISTERS else None, value, _LARGEST["register"])


def _judge(area: Area | None, value: int | None, largest: int) -> IoResult:
    if value is None:
        return IoResult.READ_ADDRESS_INVALID if area is None else IoResult.SUCCESS
    if area is None or not area.writable:
        return IoResult.WRITE_ADDRESS_INVALID
    return IoResult.SUCCESS if 0 <= value <= largest else IoResult.WRITE_VALUE_INVALID
