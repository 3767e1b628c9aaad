"""The gamepad's map: dead zone, directions, and a file that cannot be used."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
from rigs.data.device_bytes import LEFT_KEY, LEFT_X, LEFT_Y, RIGHT_KEY, RIGHT_X, RIGHT_Y

from openpendant.tools.pendants.gamepad.settings import (
    AXES,
    DeviceKind,
    GamepadSettings,
    kind_of,
    settings_of,
)
from openpendant.tools.pendants.settings_file import SettingsRefused


def spacemouse(**table: Any) -> GamepadSettings:
    return settings_of({"gamepad": {"device": "/dev/input/event7", **table}}, {}, "pad.toml")


def aimed(settings: GamepadSettings, number: int, value: float, *, shift: bool = False) -> str:
    """Return the one axis that a stick moves, with its sign; empty for none."""
    aim = settings.aim({number: value}, is_shifted=shift)
    moved = [
        f"{'+' if each > 0 else '-'}{axis}" for axis, each in zip(AXES, aim, strict=True) if each
    ]
    assert len(moved) < 2
    return "".join(moved)


@pytest.mark.parametrize(
    ("number", "value", "plain", "shifted"),
    [
        (LEFT_Y, -1.0, "+x", "+b"),
        (LEFT_X, -1.0, "+y", "-a"),
        (RIGHT_Y, -1.0, "+z", "+z"),
        (RIGHT_X, -1.0, "+c", "+c"),
        (2, -1.0, "", ""),
    ],
)
def test_each_stick_of_a_gamepad_moves_its_axis(
    number: int, value: float, plain: str, shifted: str
) -> None:
    settings = GamepadSettings()
    assert aimed(settings, number, value) == plain
    assert aimed(settings, number, value, shift=True) == shifted


@pytest.mark.parametrize(
    ("number", "axis"), [(1, "-x"), (0, "-y"), (2, "-z"), (4, "-a"), (3, "-b"), (5, "-c")]
)
def test_each_axis_of_a_spacemouse_moves_its_axis(number: int, axis: str) -> None:
    assert aimed(spacemouse(), number, 1.0) == axis


@pytest.mark.parametrize(
    ("value", "share"),
    [(0.15, 0.0), (-0.15, 0.0), (0.0, 0.0), (0.575, 0.5), (-0.575, -0.5), (1.0, 1.0), (-1.0, -1.0)],
)
def test_a_stick_counts_from_the_end_of_its_dead_zone_on_and_is_linear(
    value: float, share: float
) -> None:
    settings = settings_of({"gamepad": {"sticks": {"0": "x"}}}, {}, "")
    assert settings.aim({0: value}, is_shifted=False)[0] == pytest.approx(share)


def test_a_spacemouse_has_a_smaller_dead_zone_and_two_buttons() -> None:
    settings = spacemouse()
    assert settings.dead_zone == 0.08
    assert settings.buttons.model_dump(exclude_none=True) == {
        "enabling": LEFT_KEY,
        "stop": RIGHT_KEY,
    }


def test_two_sticks_of_one_axis_add_up_to_its_full_speed() -> None:
    settings = settings_of({"gamepad": {"sticks": {"0": "x", "1": "+x", "2": "-x"}}}, {}, "")
    assert settings.aim({0: 1.0, 1: 1.0}, is_shifted=False)[0] == 1.0
    assert settings.aim({0: 1.0, 2: 1.0}, is_shifted=False)[0] == 0.0


@pytest.mark.parametrize("number", [LEFT_X, LEFT_Y, RIGHT_X, RIGHT_Y])
def test_sticks_are_centred_where_no_axis_that_could_move_is_off(number: int) -> None:
    settings = GamepadSettings()
    assert settings.are_centred({number: 0.1, 2: -1.0, 5: -1.0})
    assert not settings.are_centred({number: -0.2})


def test_an_axis_that_only_the_shift_uses_must_be_centred_too() -> None:
    settings = settings_of({"gamepad": {"shifted": {"7": "a"}}}, {}, "")
    assert not settings.are_centred({7: 1.0})


@pytest.mark.parametrize(
    ("path", "kind"),
    [
        ("/dev/input/js0", DeviceKind.GAMEPAD),
        ("/dev/input/event7", DeviceKind.SPACEMOUSE),
        ("/dev/input/by-id/usb-3Dconnexion", DeviceKind.GAMEPAD),
    ],
)
def test_the_kind_of_a_device_is_told_by_its_name(path: str, kind: DeviceKind) -> None:
    assert kind_of(path) is kind


def test_the_file_says_the_kind_of_a_device_that_has_another_name() -> None:
    table = {"gamepad": {"device": "/dev/input/by-id/usb-3D", "kind": "spacemouse"}}
    assert settings_of(table, {}, "").buttons.enabling == LEFT_KEY


def test_arguments_go_before_the_file_and_other_tables_are_those_of_others() -> None:
    data = {"gamepad": {"device": "/dev/input/js3", "deadline": 0.2}, "keypad": {"port": "x"}}
    settings = settings_of(data, {"device": "/dev/input/js1"}, "pad.toml")
    assert (settings.device, settings.deadline) == ("/dev/input/js1", 0.2)


def test_a_button_that_a_file_names_stands_beside_those_of_the_kind() -> None:
    settings = spacemouse(buttons={"mode": 258})
    assert (settings.buttons.mode, settings.buttons.stop) == (258, RIGHT_KEY)


@pytest.mark.parametrize(
    ("table", "named"),
    [
        ({"speed": 1}, "gamepad.speed: unknown key"),
        ({"dead_zone": 0.0}, "gamepad.dead_zone: "),
        ({"deadline": 0.3}, "gamepad.deadline: "),
        ({"longest_still": 60}, "gamepad.longest_still: "),
        ({"sticks": {}}, "gamepad.sticks: "),
        ({"sticks": {"0": "w"}}, "gamepad.sticks.0: "),
        ({"sticks": {"left": "x"}}, "gamepad.sticks.left"),
        ({"buttons": {"stop": 4}}, "gamepad.buttons: Value error, each button needs a number"),
        ({"buttons": {"fire": 9}}, "gamepad.buttons.fire: unknown key"),
        ({"server": "here:0"}, "gamepad.server: "),
        ({"kind": "mouse"}, "gamepad.kind: "),
        ("js0", "gamepad: must be a table"),
    ],
)
def test_a_key_that_cannot_be_used_is_named(table: Any, named: str) -> None:
    with pytest.raises(SettingsRefused) as refused:
        settings_of({"gamepad": table}, {}, "pad.toml")
    assert str(refused.value).startswith(f"pad.toml: {named}")


def test_the_map_on_the_page_for_users_is_the_one_without_a_file() -> None:
    page = Path(__file__).parents[4] / "docs" / "gamepad.md"
    (shown,) = re.findall(r"```toml\n(.*?)```", page.read_text(), re.DOTALL)
    assert settings_of(tomllib.loads(shown), {}, "page") == GamepadSettings()
