"""Two keys at once, then one of them, then the tool: a held jog is aimed anew, smoothly.

python examples/two_keys.py [PORT]
"""

import asyncio
import sys

from openpendant.tools.pendants.client import OperatingMode, PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010


async def main() -> None:
    """Jog, aim anew, release, and take the whole way back."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="two keys") as pendant:
        async with pendant.control():
            await pendant.set_mode(OperatingMode.MANUAL_REDUCED)
            async with pendant.enabling():
                async with pendant.jog({0: 0.5, 2: -0.3}) as jog:
                    await jog.hold(0.2)
                    await jog.aim({0: 0.5})  # the second key was let go
                    await jog.hold(0.2)
                    await jog.aim_tool(z=0.5, frame="tool")
                    await jog.hold(0.2)
                there = pendant.joints()
                await (await pendant.undo_jog()).done()
        await pendant.next_state()
        here = pendant.joints()
        print("went to", [round(value, 3) for value in there])
        print("and back to", [round(value, 3) for value in here])


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
