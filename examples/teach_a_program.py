"""Teach a program of five points, correct one, try it without moving, and run it.

python examples/teach_a_program.py [PORT]
"""

import asyncio
import sys

from openpendant.tools.pendants.client import OperatingMode, PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010
NAME = "five points"
WAY = ({0: 0.02}, {1: -0.01, 2: 0.01}, {0: -0.04}, {1: 0.01, 2: -0.01}, {0: 0.02})


async def forget_the_last_run(pendant: PendantClient) -> None:
    """Delete the program that an earlier run of this example left in the store."""
    for kept in (await pendant.programs.list())["programs"]:
        if kept["name"] == NAME:
            await pendant.programs.delete(NAME, kept["revision"])


async def main() -> None:
    """Each change names the revision that it was made from; so nobody overwrites another's."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="teacher") as pendant:
        programs = pendant.programs
        await forget_the_last_run(pendant)
        saved = await programs.create(NAME)
        async with pendant.control():
            await pendant.set_mode(OperatingMode.MANUAL_REDUCED)
            async with pendant.enabling():
                for number, increments in enumerate(WAY, start=1):
                    await (await pendant.step(increments)).done()
                    point = f"p{number}"
                    saved = await programs.record(
                        NAME,
                        saved["revision"],
                        point,
                        move={"statement": "move", "way": "PTP", "point": point},
                    )
                await (await pendant.step({0: 0.01})).done()
                saved = await programs.touch_up(NAME, saved["revision"], "p5")
            trial = await programs.dry_run(NAME)
            reachable = sum(point["reachable"] for point in trial["points"])
            print(f"{reachable} of {len(trial['points'])} points can be reached,", end=" ")
            print(f"the program would take {trial['duration']:.2f} s")
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            run = await programs.run(NAME, revision=trial["revision"])
            await run.done()
        print(f"ran revision {trial['revision']} of {trial['program']!r}")


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
