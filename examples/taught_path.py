"""Teach three positions by increments, then run through them without stopping.

python examples/taught_path.py [PORT]
"""

import asyncio
import sys

from openpendant.tools.pendants.client import OperatingMode, PendantClient, PendantError, Refused

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010


async def main() -> None:
    """Teach in manual, play back at reduced speed."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="teacher") as pendant:
        async with pendant.control():
            await pendant.set_mode(OperatingMode.MANUAL_REDUCED)
            await pendant.next_state()
            start = pendant.joints()
            taught = []
            async with pendant.enabling():
                for increments in ({0: 0.05}, {1: -0.03, 2: 0.03}, {0: -0.05}):
                    await (await pendant.step(increments)).done()
                    await pendant.next_state()
                    taught.append(pendant.joints())
                try:
                    await pendant.step({0: 100.0})
                except Refused as refusal:
                    print(f"as expected: {refusal.explained}")
                await (await pendant.move_joints(start, speed=0.3)).done()
                run = await pendant.follow_joints(taught, speed=0.3)
                result = await run.done()
        print(f"ran through {len(taught)} positions in {result.motion_time:.2f} s,", end=" ")
        print(f"planned in {1000 * result.plan_time:.0f} ms")


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
