from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

from openpendant.server.settings.cell_settings import CellSettings, make_settings
from openpendant.server.settings.config_file import (
    ConfigurationError,
    load_settings,
    settings_as_toml,
)


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
    assert make_settings(tomllib.loads(settings_as_toml(settings)), "printed") == settings


def test_the_emulators_table_is_left_to_the_emulator(tmp_path: Path) -> None:
    file = tmp_path / "cell.toml"
    file.write_text('robot = "ur5"\n[emulator]\nanything = 1\n', encoding="utf-8")
    assert load_settings(file) == {"robot": "ur5"}


def test_a_missing_file_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"nowhere\.toml: cannot be read"):
        load_settings(tmp_path / "nowhere.toml")


@pytest.mark.parametrize("content", [b"robot = ", b"\xff\xfe"])
def test_a_file_that_is_no_toml_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "cell.toml"
    file.write_bytes(content)
    with pytest.raises(ConfigurationError, match=r"cell\.toml: is no TOML"):
        load_settings(file)


@pytest.mark.parametrize(
    ("period", "fresh_ms", "abort_ms"), [(0.01, 100, 250), (0.04, 100, 250), (0.2, 500, 800)]
)
def test_a_slow_controller_may_be_older(period: float, fresh_ms: int, abort_ms: int) -> None:
    link = make_settings({"controller": {"state_period": period}}, "cell.toml").controller
    assert link.fresh_age_ns == fresh_ms * 1_000_000
    assert link.abort_age_ns == abort_ms * 1_000_000


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
