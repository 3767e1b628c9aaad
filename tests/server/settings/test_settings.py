import socket
import tomllib
from pathlib import Path
from typing import Any

import pytest

from openpendant.server.settings import config_file, server_settings
from openpendant.server.settings.cell_settings import CellSettings, make_settings
from openpendant.server.settings.config_file import ConfigurationError
from openpendant.server.settings.server_settings import ServerSettings, make_server_settings
from openpendant.server.shell.controller_connection import check_controllers_apart


def refusal(data: dict[str, Any]) -> ConfigurationError:
    with pytest.raises(ConfigurationError) as caught:
        make_settings(data, "cell.toml")
    return caught.value


def test_an_empty_file_gives_the_defaults() -> None:
    assert make_settings({}, "cell.toml") == CellSettings()


@pytest.mark.parametrize(
    ("data", "key", "known"),
    [
        ({"robo": "ur5"}, "robo", "robot"),
        ({"listen": {"pendant": 1}}, "listen.pendant", "pendant_port"),
        ({"controller": {"deadline": 1}}, "controller.deadline", "reply_deadline"),
        ({"ros_i": {"alow": ["::1"]}}, "ros_i.alow", "allow"),
        ({"pendants": {"rate": 1}}, "pendants.rate", "max_state_rate"),
    ],
)
def test_an_unknown_key_is_refused_with_file_key_and_what_is_known(
    data: dict[str, Any], key: str, known: str
) -> None:
    error = refusal(data)
    assert (error.file, error.key) == ("cell.toml", key)
    assert known in error.problem
    assert str(error).startswith(f"cell.toml: {key}: ")


@pytest.mark.parametrize(
    ("data", "key"),
    [
        ({"tick_rate": 49}, "tick_rate"),
        ({"tick_rate": 251}, "tick_rate"),
        ({"tick_rate": 100.5}, "tick_rate"),
        ({"listen": {"pendant_port": 65_536}}, "listen.pendant_port"),
        ({"listen": {"pendant_port": -1}}, "listen.pendant_port"),
        ({"listen": 3}, "listen"),
        ({"controller": {"lead": 0.251}}, "controller.lead"),
        ({"controller": {"reply_deadline": float("nan")}}, "controller.reply_deadline"),
        ({"controller": {"reply_deadline": float("inf")}}, "controller.reply_deadline"),
        ({"controller": {"reply_deadline": 2.01}}, "controller.reply_deadline"),
        ({"controller": {"reply_deadline": 0.04}}, "controller.reply_deadline"),
        ({"controller": {"state_period": 0.21}}, "controller.state_period"),
        ({"controller": {"reconnect_period": 1e-6}}, "controller.reconnect_period"),
        ({"controller": {"reconnect_period": 61}}, "controller.reconnect_period"),
        ({"controller": {"byte_order": "middle"}}, "controller.byte_order"),
        ({"controller": {"real_size": 5}}, "controller.real_size"),
        ({"ros_i": {"approach_speed": 0.11}}, "ros_i.approach_speed"),
        ({"ros_i": {"trajectory_gap": 0}}, "ros_i.trajectory_gap"),
        ({"ros_i": {"resume_window": 11}}, "ros_i.resume_window"),
        ({"ros_i": {"idle_release": 61}}, "ros_i.idle_release"),
        ({"watchdog": {"deadline": 0.04}}, "watchdog.deadline"),
        ({"watchdog": {"deadline": 1.1}}, "watchdog.deadline"),
        ({"pendants": {"hello_deadline": 0.4}}, "pendants.hello_deadline"),
        ({"pendants": {"hello_deadline": 31}}, "pendants.hello_deadline"),
        ({"pendants": {"idle_timeout": 2}}, "pendants.idle_timeout"),
        ({"pendants": {"authority_timeout": "3 s"}}, "pendants.authority_timeout"),
        ({"name": ""}, "name"),
        ({"name": "ü" * 17}, "name"),
        ({"name": "two\nlines"}, "name"),
    ],
)
def test_a_value_out_of_bounds_is_refused_with_its_key(data: dict[str, Any], key: str) -> None:
    error = refusal(data)
    assert error.key == key
    assert "got" in error.problem


@pytest.mark.parametrize("table", ["controller", "listen"])
@pytest.mark.parametrize(
    "host", ["", "a..b", ".a", "a" * 64, "a." * 127, "two words", "a\0b", "a\n", "ü..b"]
)
def test_what_can_be_no_host_is_refused_with_what_would_be_one(table: str, host: str) -> None:
    error = refusal({table: {"host": host}})
    assert error.key == f"{table}.host"
    assert "accepted: an address or a host name" in error.problem


@pytest.mark.parametrize(
    "host", ["10.0.0.1", "127.1", "::1", "fe80::1%eth0", "ARM.plant.", "bär.de"]
)
def test_addresses_and_names_are_taken_as_hosts(host: str) -> None:
    assert make_settings({"controller": {"host": host}}, "cell.toml").controller.host == host


@pytest.mark.parametrize(
    "data",
    [
        {},
        {"name": 'a "cell" \\ ü', "robot": "C:\\robots\\x\t\x7f.yaml"},
        {"tick_rate": 250, "controller": {"points": "simple", "stop_connection": False}},
        {"ros_i": {"allow": ["10.0.0.1", "::1"], "resume_window": 1e-5}},
    ],
)
def test_printed_settings_give_the_same_settings_again(data: dict[str, Any]) -> None:
    settings = make_settings(data, "cell.toml")
    printed = tomllib.loads(config_file.settings_as_toml(settings))
    assert make_settings(printed, "printed") == settings


def test_the_emulators_table_is_left_to_the_emulator(tmp_path: Path) -> None:
    file = tmp_path / "cell.toml"
    file.write_text('robot = "ur5"\n[emulator]\nanything = 1\n', encoding="utf-8")
    assert config_file.load_settings(file) == {"robot": "ur5"}


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"nowhere\.toml: cannot be read"):
        config_file.load_settings(tmp_path / "nowhere.toml")


@pytest.mark.parametrize("content", [b"robot = ", b"\xff\xfe"])
def test_a_file_that_is_no_toml_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "cell.toml"
    file.write_bytes(content)
    with pytest.raises(ConfigurationError, match=r"cell\.toml: is no TOML"):
        config_file.load_settings(file)


@pytest.mark.parametrize(
    ("period", "fresh_ms", "abort_ms"), [(0.01, 100, 250), (0.04, 100, 250), (0.2, 500, 800)]
)
def test_a_slow_controller_may_be_older(period: float, fresh_ms: int, abort_ms: int) -> None:
    link = make_settings({"controller": {"state_period": period}}, "cell.toml").controller
    assert (link.fresh_age_ns, link.abort_age_ns) == (fresh_ms * 1_000_000, abort_ms * 1_000_000)


@pytest.mark.parametrize(
    ("deadline", "real", "emulated"),
    [("by controller", 0.1, 0.4), (0.05, 0.05, 0.05), (0.3, 0.1, 0.3), (1.0, 0.1, 1.0)],
)
def test_a_deadline_that_a_file_names_counts_and_is_never_above_100_ms_on_a_real_controller(
    deadline: float | str, real: float, emulated: float
) -> None:
    rule = make_settings({"watchdog": {"deadline": deadline}}, "cell.toml").watchdog
    assert (rule.real_deadline, rule.emulated_deadline) == (real, emulated)


@pytest.mark.parametrize(
    ("given", "lead"),
    [
        ({}, 0.25),
        ({"lead": 0.2}, 0.2),
        ({"stop_connection": False}, 0.1),
        ({"stop_connection": False, "lead": 0.08}, 0.08),
    ],
)
def test_planned_motion_is_sent_less_far_ahead_where_the_watchdog_has_to_connect_first(
    given: dict[str, Any], lead: float
) -> None:
    assert make_settings({"controller": given}, "cell.toml").controller.planned_lead == lead


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


def settings_of(data: dict[str, Any]) -> ServerSettings:
    settings = make_server_settings(data, "room.toml")
    check_controllers_apart(settings, "room.toml")
    return settings


def refusal_of_server(data: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationError) as caught:
        settings_of(data)
    return str(caught.value)


def test_a_cell_file_is_a_server_of_one_cell() -> None:
    settings = make_server_settings({"robot": "kr6"}, "cell.toml")
    assert settings == ServerSettings((CellSettings(robot="kr6"),))


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
    printed = tomllib.loads(server_settings.server_settings_as_toml(settings))
    assert make_server_settings(printed, "printed") == settings


@pytest.mark.parametrize(
    ("cell", "table", "change", "said"),
    [
        (1, "controller", {"lead": 0.3}, "controller.lead of cell 'right': "),
        (
            *(0, "listen", {"pendant_port": 11010}),
            "listen.pendant_port of cell 'left': unknown key; known here: ros_motion_port,"
            " ros_state_port",
        ),
        (1, None, {"name": None}, "name of cell 2: must be given"),
        (1, None, {"name": "left"}, "name of cell 'left'"),
        (
            *(1, "controller", {"motion_port": 12000}),
            "controller.motion_port of cell 'right': 127.0.0.1 port 12000 is the controller of cell"
            " 'left' already",
        ),
    ],
    ids=["out of bounds", "an unknown key", "no name", "one name twice", "one controller twice"],
)
def test_what_is_wrong_with_a_cell_is_refused_with_key_and_cell(
    cell: int, table: str | None, change: dict[str, Any], said: str
) -> None:
    data = room()
    place = data["cells"][cell] if table is None else data["cells"][cell][table]
    place.update(change)
    data["cells"][cell] = {k: v for k, v in data["cells"][cell].items() if v is not None}
    assert refusal_of_server(data).startswith(f"room.toml: {said}")


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
    said = refusal_of_server(with_hosts(left, right))
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
    said = refusal_of_server({**room(), key: "ur5"})
    assert said.startswith(f"room.toml: {key}: belongs to one cell")


@pytest.mark.parametrize("cells", [[], 3, "left", [3], [{"name": "x"}] * 65])
def test_cells_that_are_no_tables_or_too_many_are_refused(cells: object) -> None:
    said = refusal_of_server({"cells": cells})
    assert said.startswith("room.toml: cells: expected 1 to 64 tables")


PAGE = Path(__file__).parents[3] / "docs" / "configuration.md"
DEFAULTS = CellSettings().model_dump(mode="json")


def documented() -> dict[str, object]:
    example = PAGE.read_text("utf-8").partition("```toml\n")[2].partition("```")[0]
    shown = tomllib.loads(example)
    del shown["emulator"]
    shown["gateways"] = []  # there is none by itself; the example of one stands further down
    return shown


def test_no_table_and_no_key_is_unknown_or_left_out() -> None:
    shown = documented()
    assert shown.keys() == DEFAULTS.keys()
    for name, table in DEFAULTS.items():
        if isinstance(table, dict):
            assert isinstance(shown[name], dict)
            assert shown[name].keys() == table.keys(), name  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", DEFAULTS)
def test_each_key_is_shown_with_its_default(name: str) -> None:
    assert documented()[name] == DEFAULTS[name]
