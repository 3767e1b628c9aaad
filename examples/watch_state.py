"""Look on: ten states in a second, and whatever else happens. Needs no authority.

python examples/watch_state.py [PORT]
"""

import asyncio
import math
import sys

from openpendant.simplemsg.pendant import Activity, OperatingMode
from openpendant.tools.pendants.client import PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010
STATES = 10


async def main() -> None:
    """Print states; the newest only, however slow this program is."""
    async with await PendantClient.connect(
        "127.0.0.1", PORT, client="watcher", state_rate=10
    ) as pendant:
        pendant.on_authority = lambda change: print(f"in control: {change.client or 'nobody'}")
        pendant.on_stop = lambda change: print(f"stop {change.stop}: {change.reason}")
        joints = (await pendant.snapshot())["joints"]
        print("joints:", ", ".join(joint["name"] for joint in joints))
        seen = 0
        async for state in pendant.states():
            degrees = [round(math.degrees(value), 1) for value in pendant.joints()]
            mode = OperatingMode(state.operating_mode).name
            print(f"{state.sequence:6} {Activity(state.activity).name:8} {mode:14} {degrees}")
            seen += 1
            if seen == STATES:
                break


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
