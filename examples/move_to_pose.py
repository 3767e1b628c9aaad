"""Move the tool centre point (TCP) to Cartesian poses along straight lines, and back.

python examples/move_to_pose.py [PORT]
"""

import asyncio
import math
import sys
from dataclasses import replace

from openpendant.tools.pendants.client import Motion, OperatingMode, PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010


async def main() -> None:
    """Move in joint space to where the elbow is bent, then move the TCP by LIN."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="mover") as pendant:
        async with pendant.control():
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            await pendant.next_state()
            before = pendant.joints()
            ready = [before[0], -1.2, 1.4, -1.8, -1.5, 0.0]
            await (await pendant.move_joints(ready, speed=0.5)).done()
            await pendant.next_state()
            start = pendant.tool_pose()
            x, y, z = start.position
            goal = replace(start, position=(x, y + 0.03, z - 0.05))
            move = await pendant.move_to_pose(goal, motion=Motion.LIN, speed=0.2)
            await move.done()
            await pendant.next_state()
            reached = pendant.tool_pose()
            back = await pendant.move_to_pose(start, motion=Motion.LIN, speed=0.2)
            await back.done()
            await (await pendant.move_joints(before, speed=0.5)).done()
    error = 1e3 * math.dist(reached.position, goal.position)
    print(f"reached the pose in frame {goal.frame!r}, {error:.2f} mm off")


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
