"""Pause a motion on its path, slow it down, and let it go on.

python examples/pause_and_resume.py [PORT]
"""

import asyncio
import sys

from openpendant.simplemsg.pendant import Activity
from openpendant.tools.pendants.client import OperatingMode, PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010


async def main() -> None:
    """Pause halfway; a pause is no stop: nothing is latched and nothing is lost."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="pauser") as pendant:
        async with pendant.control():
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            await pendant.next_state()
            start = pendant.joints()
            target = [start[0] + 0.4, *start[1:]]
            move = await pendant.move_joints(target, speed=0.2)
            await pendant.wait_until(lambda state: state.positions[0] > start[0] + 0.1)
            await pendant.pause()
            await pendant.wait_until(
                lambda state: state.activity == Activity.PAUSED and not any(state.velocities)
            )
            print(f"paused at {pendant.joints()[0]:.4f} rad, {target[0]:.4f} is the target")
            await pendant.set_speed(0.5)
            await pendant.resume()
            await move.done()
            await pendant.set_speed(1.0)
        await pendant.next_state()
        print(f"arrived at {pendant.joints()[0]:.4f} rad")


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
