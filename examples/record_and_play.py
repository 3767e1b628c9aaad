"""Record a motion as it happens, then play it back at twice the speed.

python examples/record_and_play.py [PORT]
"""

import asyncio
import sys

from openpendant.tools.pendants.client import OperatingMode, PendantClient, PendantError

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010
NAME = "there and back"


async def forget_the_last_run(pendant: PendantClient) -> None:
    """Delete the recording that an earlier run of this example left in the store."""
    for kept in (await pendant.recordings.list())["recordings"]:
        if kept["name"] == NAME:
            await pendant.recordings.delete(NAME, kept["revision"])


async def main() -> None:
    """Whatever moves the robot is recorded: here two moves, as well a jog or a program."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="recorder") as pendant:
        await forget_the_last_run(pendant)
        async with pendant.control():
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            await pendant.next_state()
            here = pendant.joints()
            await pendant.recordings.start(NAME)
            for target in ([here[0] + 0.15, *here[1:]], here):
                await (await pendant.move_joints(target, speed=0.1)).done()
            made = await pendant.recordings.stop()
            print(f"recorded {made['samples']} samples in {made['duration']:.2f} s,", end=" ")
            print(f"{made['rate']:.0f} a second, {made['gaps']} gaps")
            playback = await pendant.recordings.play(NAME, factor=2.0)
            await playback.done()
        account = playback.account
        print(f"played back in {account['possible']:.2f} s: {account['factor']:.2f} times as fast")


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
