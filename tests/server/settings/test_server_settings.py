from __future__ import annotations

import socket
import tomllib
from typing import Any

import pytest

from openpendant.server.settings.cell_settings import CellSettings
from openpendant.server.settings.config_file import ConfigurationError
from openpendant.server.settings.server_settings import (
    MOST_CELLS,
    ServerSettings,
    make_server_settings,
    server_settings_as_toml,
)
from openpendant.server.shell.controller_connection import check_controllers_apart

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
        settings_of(data)
    return str(caught.value)


def settings_of(data: dict[str, Any]) -> ServerSettings:
    settings = make_server_settings(data, "room.toml")
    check_controllers_apart(settings, "room.toml")
    return settings


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
    data["cells"][1]["controller"]["lead"] = 0.3
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


NAMES = {"arm.plant": ["10.1.2.3"], "arm-old.plant": ["fe80::7", "10.1.2.3"]}
"""What the name service of these tests knows."""


@pytest.fixture
def name_service(monkeypatch: pytest.MonkeyPatch) -> None:
    ask = socket.getaddrinfo

    def answer(host: str, *more: Any, **named: Any) -> Any:
        if host[:1].isdecimal() or ":" in host or host.lower() == "localhost":
            return ask(host, *more, **named)
        if host not in NAMES:
            raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")
        return [answer for ip in NAMES[host] for answer in ask(ip, *more, **named)]

    monkeypatch.setattr(socket, "getaddrinfo", answer)


def with_hosts(left: str, right: str, port: int = 12000) -> dict[str, Any]:
    data = room()
    data["cells"][0]["controller"]["host"] = left
    data["cells"][1]["controller"] |= {"host": right, "state_port": port}
    return data


@pytest.mark.usefixtures("name_service")
@pytest.mark.parametrize(
    ("left", "right", "both"),
    [
        ("127.0.0.1", "localhost", "127.0.0.1"),
        ("LOCALHOST", "localhost", "127.0.0.1"),
        ("127.0.0.1", "127.1", "127.0.0.1"),
        ("127.0.0.1", "127.0.0.2", "127.0.0.1"),
        ("::1", "127.0.0.1", "127.0.0.1"),
        ("0.0.0.0", "127.0.0.1", "127.0.0.1"),
        ("::ffff:10.1.2.3", "10.1.2.3", "10.1.2.3"),
        ("fe80::0007", "fe80::7", "fe80::7"),
        ("arm.plant", "10.1.2.3", "10.1.2.3"),
        ("arm.plant", "ARM.Plant.", "10.1.2.3"),
        ("arm.plant", "arm-old.plant", "10.1.2.3"),
        ("unknown.plant", "Unknown.plant.", "unknown.plant"),
    ],
)
def test_one_controller_by_two_names_is_refused_with_both_cells_and_its_address(
    left: str, right: str, both: str
) -> None:
    said = refusal(with_hosts(left, right))
    assert said == (
        f"room.toml: controller.state_port of cell 'right': {right} port 12000 is the controller"
        f" of cell 'left' already, where it is called {left}; both are {both}"
    )


@pytest.mark.usefixtures("name_service")
@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("10.1.2.3", "10.1.2.4"),
        ("arm.plant", "10.1.2.4"),
        ("unknown.plant", "arm.plant"),
        ("unknown.plant", "other.plant"),
        ("fe80::7%1", "fe80::7%2"),
    ],
)
def test_controllers_that_differ_are_taken_on_the_same_port(left: str, right: str) -> None:
    cells = settings_of(with_hosts(left, right)).cells
    assert [cell.controller.host for cell in cells] == [left, right]


def test_no_name_is_asked_for_where_no_port_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(socket, "getaddrinfo")
    settings_of(with_hosts("arm.plant", "arm-old.plant", 12006))


@pytest.mark.parametrize("key", ["name", "robot", "controller", "ros_i", "modes", "jog"])
def test_what_belongs_to_a_cell_is_refused_beside_the_cells(key: str) -> None:
    assert refusal({**room(), key: "ur5"}).startswith(f"room.toml: {key}: belongs to one cell")


@pytest.mark.parametrize("cells", [[], 3, "left", [3], [{"name": "x"}] * (MOST_CELLS + 1)])
def test_cells_that_are_no_tables_or_too_many_are_refused(cells: object) -> None:
    assert refusal({"cells": cells}).startswith("room.toml: cells: expected 1 to 64 tables")
