"""From nothing to a moving joint: connect, take control, enable, jog, release.

Start a robot and its server first (see docs/pendant-apps.md), then:

    python examples/connect_and_jog.py [PORT]
"""

import asyncio
import sys

from openpendant.tools.pendants.client import OperatingMode, PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010


async def main() -> None:
    """Jog the first joint for half a second."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="jogger") as pendant:
        print(f"connected to {pendant.hello.server}, robot {pendant.hello.robot}")
        async with pendant.control():
            await pendant.set_mode(OperatingMode.MANUAL_REDUCED)
            async with pendant.enabling(), pendant.jog({0: 0.5}) as jog:
                await jog.hold(0.5)
        account = jog.account
        assert account is not None  # leaving the jog waited for it
        print(f"let go: stood after {1000 * account.stop_time:.0f} ms", end=", ")
        print(f"joint 1 at {account.positions[0]:.4f} rad")


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
