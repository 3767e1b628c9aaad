"""Make a plan, look at its samples, and execute exactly those; then back.

python examples/plan_and_execute.py [PORT]
"""

import asyncio
import sys
from collections.abc import Sequence

from openpendant.tools.pendants.client import OperatingMode, PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010


async def execute(pendant: PendantClient, joints: Sequence[float]) -> str:
    """Plan a way to a joint position around what stands in the cell, and execute it."""
    made = await pendant.plans.make(
        {"kind": "free", "joints": list(joints), "planner": "BuiltInRRTConnect", "seed": 1}
    )
    rows: list[list[float]] = []
    while True:
        shown = await pendant.plans.samples(made["plan"], first=len(rows))
        rows += shown["rows"]
        if not shown["more"]:
            break
        await asyncio.sleep(0.05)  # at most 20 such questions a second
    speeds = slice(1 + len(joints), 1 + 2 * len(joints))
    fastest = max(abs(value) for row in rows for value in row[speeds])
    await (await pendant.execute(made["plan"])).done()
    return f"{len(rows)} samples, {made['duration']:.2f} s, at most {fastest:.2f} rad/s"


async def main() -> None:
    """Turn the first joint by a plan, and back by another."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="planner") as pendant:
        async with pendant.control():
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            await pendant.next_state()
            before = pendant.joints()
            print(await execute(pendant, [before[0] + 0.4, *before[1:]]))
            print(await execute(pendant, before))


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
