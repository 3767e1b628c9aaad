"""The screen that the page of the terminal pendant shows is the one that the pendant draws."""

import math
from itertools import zip_longest
from pathlib import Path

from rigs.cells.panel_rig import HELLO, PanelRig, snapshot

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.paths.mechanism import mechanism
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import EnablingPosition
from openpendant.simplemsg.pendant.management.cell import JointFacts
from openpendant.tools.pendants.panel import lcd
from openpendant.tools.pendants.terminal import screen_text
from openpendant.tools.pendants.terminal.missing_steps import steps_line

PAGE = Path(__file__).parents[4] / "docs" / "terminal-pendant.md"

LEFT = 44
"""Columns of the display and of what stands under it, as `app` lays it out."""


def ur5_in_t1() -> PanelRig:
    """A UR5 near its home, in our control and enabled."""
    limits = serial_robot("ur5").limits
    joints = [
        JointFacts(
            name=name,
            display_name=shown,
            unit="rad",
            lower=limits.lower[index],
            upper=limits.upper[index],
            velocity=limits.velocity[index],
            acceleration=limits.acceleration[index],
        )
        for index, (name, shown) in enumerate(zip(limits.names, limits.display_names, strict=True))
    ]
    rig = PanelRig(connected=False)
    rig.panel.cell.connected(HELLO, snapshot(joints=joints))
    rig.panel.connected()
    position = list(map(math.radians, (1.0, -90.0, 90.0, -90.0, -90.0, 0.0)))
    pose = mechanism(serial_robot("ur5")).forward(position, "base")
    x, y, z = pose.position.tolist()
    qx, qy, qz, qw = pose.quaternion.tolist()
    rig.state(
        positions=joint_array(position),
        tool_position=(x, y, z),
        tool_orientation=(qx, qy, qz, qw),
        enabling=EnablingPosition.HELD,
    )
    rig.strike("v")
    return rig


def picture(rig: PanelRig) -> str:
    """Return the screen as the layout of `app` composes it, up to the messages."""
    panel, now = rig.panel, rig.now
    rows = [" ┏━━━━━━━━━━━━━━━━━━━━━━┓"]
    rows += [f" ┃ {row} ┃" for row in lcd.page(panel, now)]
    rows += [" ┗━━━━━━━━━━━━━━━━━━━━━━┛", *screen_text.jog_line(panel, now).split("\n")]
    facts = [*screen_text.joint_table(panel).split("\n")]
    facts += [*screen_text.pose_table(panel).split("\n"), ""]
    facts += screen_text.program_list(panel).split("\n")
    top = [
        screen_text.lamp_line(panel, now),
        screen_text.status_line(panel, now),
        steps_line(panel, now),
    ]
    middle = [f"{left:<{LEFT}}{right}" for left, right in zip_longest(rows, facts, fillvalue="")]
    return "\n".join(line.rstrip() for line in [*top, *middle])


def test_the_page_shows_the_screen_as_it_is_drawn() -> None:
    assert f"```\n{picture(ur5_in_t1())}\n```" in PAGE.read_text(encoding="utf-8")
