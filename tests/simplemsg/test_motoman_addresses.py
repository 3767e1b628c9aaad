from itertools import pairwise

import pytest

from openpendant.simplemsg.motoman import IoResult
from openpendant.simplemsg.motoman_addresses import (
    AREAS,
    REGISTER_OFFSET,
    ControllerModel,
    area_of,
    bits_of_group,
    judge_bit,
    judge_group,
    judge_register,
    register_number,
)

READ, WRITE = IoResult.READ_ADDRESS_INVALID, IoResult.WRITE_ADDRESS_INVALID


@pytest.mark.parametrize("controller", ControllerModel)
def test_areas_begin_and_end_at_whole_groups_and_never_overlap(
    controller: ControllerModel,
) -> None:
    areas = AREAS[controller]
    assert all(area.first % 10 == 0 and area.last % 10 == 7 for area in areas)
    assert all(low.last < high.first for low, high in pairwise(areas))


@pytest.mark.parametrize(
    ("controller", "bit", "name"),
    [
        (ControllerModel.DX100, 2567, "general input"),
        (ControllerModel.FS100, 1287, "general input"),
        (ControllerModel.DX200, 5127, "general input"),
        (ControllerModel.DX100, 25010, "network input"),
        (ControllerModel.YRC1000, 27010, "network input"),
        (ControllerModel.DX200, 53007, "specific output"),
        (ControllerModel.YRC1000, 55127, "specific output"),
        (ControllerModel.DX200, 82010, "pseudo input"),
        (ControllerModel.YRC1000MICRO, 87010, "pseudo input"),
    ],
)
def test_a_bit_lies_in_its_models_area(controller: ControllerModel, bit: int, name: str) -> None:
    area = area_of(controller, bit)
    assert area is not None
    assert area.name == name


@pytest.mark.parametrize(
    ("controller", "bit", "value", "verdict"),
    [
        (ControllerModel.FS100, 1290, None, READ),
        (ControllerModel.DX200, 25200, None, READ),
        (ControllerModel.YRC1000, 82010 + 4_000, None, READ),
        *((ControllerModel.DX100, bit, None, READ) for bit in (18, 19, 0, -10)),
        *((ControllerModel.YRC1000, bit, 1, IoResult.SUCCESS) for bit in (10010, 27010, 60010)),
        *((ControllerModel.YRC1000, bit, 1, WRITE) for bit in (10, 37010, 10018)),
        *((ControllerModel.DX100, 10010, bad, IoResult.WRITE_VALUE_INVALID) for bad in (-1, 2)),
    ],
)
def test_only_bits_can_be_read_and_only_some_be_written_and_to_zero_or_one(
    controller: ControllerModel, bit: int, value: int | None, verdict: IoResult
) -> None:
    assert judge_bit(controller, bit, value) is verdict


def test_a_group_is_an_address_without_its_last_digit() -> None:
    assert list(bits_of_group(1001)) == list(range(10010, 10018))
    assert judge_group(ControllerModel.DX100, 1001, 255) is IoResult.SUCCESS
    assert judge_group(ControllerModel.DX100, 1001, 256) is IoResult.WRITE_VALUE_INVALID


@pytest.mark.parametrize("offset", [0, REGISTER_OFFSET])
def test_a_register_goes_by_its_number_or_its_address(offset: int) -> None:
    assert register_number(offset + 559) == 559
    assert judge_register(offset + 999) is IoResult.SUCCESS
    assert judge_register(offset + 1_000) is READ
    assert judge_register(offset + 559, 65_535) is IoResult.SUCCESS
    assert judge_register(offset + 559, 65_536) is IoResult.WRITE_VALUE_INVALID
    assert judge_register(offset + 560, 0) is WRITE
