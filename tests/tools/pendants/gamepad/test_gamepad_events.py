"""Events of input devices: bytes of the kernel, read as sticks and buttons."""

import pytest
from rigs.data.device_bytes import (
    ABS,
    DROPPED,
    ENABLING,
    KEY,
    LEFT_KEY,
    LEFT_X,
    REL,
    REPORT,
    SYN,
    axis,
    button,
    event,
    report,
)

from openpendant.tools.pendants.gamepad.device_events import (
    CENTRE_NS,
    ButtonTurned,
    DeviceEvent,
    EvdevReader,
    EventCut,
    EventsLost,
    JoystickReader,
    StickMoved,
)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (axis(LEFT_X, 1.0), StickMoved(LEFT_X, 1.0)),
        (bytes.fromhex("00000000 0080 02 07"), StickMoved(7, -1.0)),
        (axis(LEFT_X, 0.0, at_opening=True), StickMoved(LEFT_X, 0.0, is_at_opening=True)),
        (button(ENABLING, down=True), ButtonTurned(ENABLING, True)),
        (button(ENABLING, down=False), ButtonTurned(ENABLING, False)),
        (
            button(ENABLING, down=True, at_opening=True),
            ButtonTurned(ENABLING, True, is_at_opening=True),
        ),
    ],
)
def test_the_joystick_interface_tells_axes_and_buttons(data: bytes, told: DeviceEvent) -> None:
    assert JoystickReader().receive(data, 0) == [told]


def test_an_event_of_another_kind_is_none() -> None:
    assert JoystickReader().receive(bytes.fromhex("00000000 0100 04 01"), 0) == []


@pytest.mark.parametrize("cut", range(1, 8))
def test_a_read_that_ends_within_an_event_tells_the_whole_ones_and_that(cut: int) -> None:
    data = button(1, down=True) + axis(LEFT_X, 0.5)[:cut]
    assert JoystickReader().receive(data, 0) == [ButtonTurned(1, True), EventCut()]


def test_a_read_within_an_event_of_evdev_is_told_too() -> None:
    data = report((KEY, LEFT_KEY, 1)) + event(ABS, 0, 1)[:23]
    assert EvdevReader().receive(data, 0) == [ButtonTurned(LEFT_KEY, True), EventCut()]


@pytest.mark.parametrize(
    ("value", "share"), [(350, 1.0), (-350, -1.0), (175, 0.5), (4_000, 1.0), (0, 0.0)]
)
def test_a_spacemouse_is_read_as_a_part_of_its_deflection(value: int, share: float) -> None:
    assert EvdevReader().receive(report((ABS, 2, value)), 0) == [StickMoved(2, share)]


def test_a_set_counts_once_it_is_whole() -> None:
    reader = EvdevReader()
    assert reader.receive(event(ABS, 0, 350) + event(ABS, 1, -350), 0) == []
    assert reader.receive(REPORT, 0) == [StickMoved(0, 1.0), StickMoved(1, -1.0)]
    assert reader.receive(REPORT, 0) == []


def test_what_was_lost_is_told_and_the_rest_of_it_counts_no_more() -> None:
    reader = EvdevReader()
    told = reader.receive(event(ABS, 0, 350) + DROPPED + event(ABS, 1, 350) + REPORT, 0)
    assert told == [EventsLost()]
    assert reader.receive(report((ABS, 2, 350)), 0) == [StickMoved(2, 1.0)]


def test_a_repetition_of_a_key_and_axes_that_no_cap_has_are_none() -> None:
    data = report((KEY, LEFT_KEY, 2), (ABS, 6, 5), (REL, 8, 1), (4, 4, 7)) + event(SYN, 1, 0)
    assert EvdevReader().receive(data, 0) == []


def test_a_relative_axis_that_is_not_repeated_is_centred_after_a_while() -> None:
    reader = EvdevReader()
    reader.receive(report((REL, 0, 100), (REL, 5, 100)), 0)
    reader.receive(report((REL, 5, 100)), CENTRE_NS // 2)
    assert reader.tick(CENTRE_NS - 1) == []
    assert reader.tick(CENTRE_NS) == [StickMoved(0, 0.0)]
    assert reader.tick(2 * CENTRE_NS) == [StickMoved(5, 0.0)]
    assert reader.tick(9 * CENTRE_NS) == []


def test_an_absolute_axis_stays_where_it_is() -> None:
    reader = EvdevReader()
    reader.receive(report((ABS, 0, 100)), 0)
    assert reader.tick(99 * CENTRE_NS) == []


def test_a_relative_axis_is_not_centred_after_events_were_lost_as_nobody_knows_it() -> None:
    reader = EvdevReader()
    reader.receive(report((REL, 0, 100)), 0)
    reader.receive(DROPPED + REPORT, 0)
    assert reader.tick(CENTRE_NS) == []
