"""The demonstration's table of the newest state."""

from dataclasses import replace
from io import StringIO

from rich.console import Console
from rigs.peers.scripted_pendant_server import DOF, state

from openpendant.simplemsg.pendant import OperatingMode, State
from openpendant.simplemsg.pendant.management.cell import JointFacts
from openpendant.tools.pendants.demo_pendant import live_table

JOINTS = [
    JointFacts(
        name=f"joint_{number}", unit="rad", lower=-1.0, upper=1.0, velocity=1.0, acceleration=2.0
    )
    for number in range(1, DOF + 1)
]


def page(newest: State | None) -> str:
    screen = StringIO()
    Console(file=screen, width=80).print(live_table(newest, JOINTS, "moving"))
    return screen.getvalue()


def test_a_joint_that_hardly_moves_backwards_shows_no_signed_zero() -> None:
    creeping = replace(
        state(1),
        positions=(-1e-9,) * 10,
        velocities=(-1e-9,) * 10,
        tool_position=(-1e-9,) * 3,
        tool_orientation=(-1e-9, 0.0, 0.0, 1.0),
    )
    shown = page(creeping)
    assert "0.00°/s" in shown
    assert "-0.0" not in shown


def test_positions_are_shown_in_degrees_and_millimetres() -> None:
    shown = page(state(1))
    assert "7.16°" in shown
    assert "500.0    250.0    750.0 mm" in shown


def test_before_the_first_state_the_table_has_its_title_only() -> None:
    assert "moving" in page(None)
    assert "joint_1" not in page(None)


def test_an_activity_of_a_newer_server_is_shown_as_unknown() -> None:
    rows = page(replace(state(1, mode=OperatingMode.AUTOMATIC), activity=99)).splitlines()
    (row,) = (each for each in rows if "│ mode " in each)
    assert row.split() == ["│", "mode", "│", "automatic", "│", "unknown", "│"]
