"""Files of several cells: what is taken, and what is refused with the key and the cell's name."""

from __future__ import annotations

import tomllib
from typing import Any

import pytest

from openpendant.server.configuration_file import ConfigurationError
from openpendant.server.server_settings import (
    MOST_CELLS,
    ServerSettings,
    make_server_settings,
    server_settings_as_toml,
)
from openpendant.server.settings import CellSettings

ROOM = """
tick_rate = 125
listen.pendant_port = 0

[[cells]]
name = "left"
robot = "kr6"
controller = {motion_port = 12000, state_port = 12002}
listen = {ros_motion_port = 0, ros_state_port = 11002}

[[cells]]
name = "right"
modes.initial = "manual_reduced"
controller = {motion_port = 12004, state_port = 12006}
"""


def room() -> dict[str, Any]:
    return tomllib.loads(ROOM)


def refusal(data: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationError) as caught:
        make_server_settings(data, "room.toml")
    return str(caught.value)


def test_a_cell_file_is_a_server_of_one_cell() -> None:
    assert make_server_settings({"robot": "kr6"}, "cell.toml") == ServerSettings(
        (CellSettings(robot="kr6"),)
    )


def test_each_cell_has_its_own_tables_and_all_share_the_rest() -> None:
    left, right = make_server_settings(room(), "room.toml").cells
    assert (left.name, left.robot, left.controller.motion_port) == ("left", "kr6", 12000)
    assert (right.name, right.robot, right.modes.initial) == ("right", "ur5", "manual_reduced")
    assert {cell.tick_rate for cell in (left, right)} == {125}
    assert {cell.listen.pendant_port for cell in (left, right)} == {0}


def test_ros_ports_are_off_unless_a_cell_asks_for_them() -> None:
    left, right = make_server_settings(room(), "room.toml").cells
    assert (left.listen.ros_motion_port, left.listen.ros_state_port) == (0, 11002)
    assert (right.listen.ros_motion_port, right.listen.ros_state_port) == (None, None)


def test_ros_ports_of_a_single_cell_can_be_turned_off() -> None:
    listen = {"ros_motion_port": "off", "ros_state_port": "off"}
    (cell,) = make_server_settings({"listen": listen}, "cell.toml").cells
    assert (cell.listen.ros_motion_port, cell.listen.ros_state_port) == (None, None)


@pytest.mark.parametrize("data", [{}, {"listen": {"ros_state_port": "off"}}, room()])
def test_printed_settings_give_the_same_server_again(data: dict[str, Any]) -> None:
    settings = make_server_settings(data, "room.toml")
    printed = tomllib.loads(server_settings_as_toml(settings))
    assert make_server_settings(printed, "printed") == settings


def test_a_value_out_of_bounds_is_refused_with_key_and_cell() -> None:
    data = room()
    data["cells"][1]["controller"]["lead"] = 0.2
    assert refusal(data).startswith("room.toml: controller.lead of cell 'right': ")


def test_an_unknown_key_of_a_cell_is_refused_with_what_is_known_there() -> None:
    data = room()
    data["cells"][0]["listen"]["pendant_port"] = 11010
    assert refusal(data) == (
        "room.toml: listen.pendant_port of cell 'left': unknown key; known here:"
        " ros_motion_port, ros_state_port"
    )


def test_a_cell_without_a_name_is_refused_by_its_place() -> None:
    data = room()
    del data["cells"][1]["name"]
    assert refusal(data) == "room.toml: name of cell 2: must be given"


def test_two_cells_of_one_name_are_refused() -> None:
    data = room()
    data["cells"][1]["name"] = "left"
    assert "name of cell 'left'" in refusal(data)


def test_two_cells_that_drive_one_controller_are_refused() -> None:
    data = room()
    data["cells"][1]["controller"]["motion_port"] = 12000
    assert refusal(data) == (
        "room.toml: controller.motion_port of cell 'right': 127.0.0.1 port 12000 is the controller"
        " of cell 'left' already"
    )


@pytest.mark.parametrize("key", ["name", "robot", "controller", "ros_i", "modes", "jog"])
def test_what_belongs_to_a_cell_is_refused_beside_the_cells(key: str) -> None:
    assert refusal({**room(), key: "ur5"}).startswith(f"room.toml: {key}: belongs to one cell")


@pytest.mark.parametrize("cells", [[], 3, "left", [3], [{"name": "x"}] * (MOST_CELLS + 1)])
def test_cells_that_are_no_tables_or_too_many_are_refused(cells: object) -> None:
    assert refusal({"cells": cells}).startswith("room.toml: cells: expected 1 to 64 tables")
