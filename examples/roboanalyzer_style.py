"""The calls of RoboAnalyzer's virtual robot server: degrees, millimetres, joints from 1.

python examples/roboanalyzer_style.py [PORT]
"""

import sys

from openpendant.tools.pendants.client import PendantError
from openpendant.tools.pendants.roboanalyzer import RoboAnalyzerClient

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010


def main() -> None:
    """Go home, move a joint and the tool a little, and go back."""
    with RoboAnalyzerClient("127.0.0.1", PORT, speed=0.4) as robot:
        print("robot:", robot.DisplayRobot().name)
        robot.SetHomePosition()
        before = robot.UpdateRobot()
        robot.IncrementJointAngle(1, 5.0)
        robot.IncrementZ(-20.0)
        robot.IncrementA(5.0)  # the roll value; a jog about an axis is something else
        after = robot.UpdateRobot()
        robot.UpdateJointAngles(before.joints)
        print(f"Z from {before.z:.1f} to {after.z:.1f} mm, A from {before.a:.1f} to {after.a:.1f}°")


try:
    main()
except PendantError as error:
    sys.exit(error.explained)
