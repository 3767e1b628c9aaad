"""Pulls the cable between a server and two pendants, one told states and one told nothing.

Run in a network of its own (`unshare --net`), whose loopback it takes down when its input ends.
Prints how many connections there are before, and then after how many seconds the server gave up
each.
"""

import asyncio
import socket
import subprocess
import sys
import time

from rigs.processes.app_on_loop import said
from rigs.processes.judged_server import served_cell

from openpendant.simplemsg.pendant import Subscribe

_PATIENCE = 20.0


def loopback(state: str) -> None:
    subprocess.run(["ip", "link", "set", "lo", state], check=True)


async def main() -> None:
    loopback("up")
    app, _ = served_cell(listen={"ros_motion_port": "off", "ros_state_port": "off"})
    async with app.running() as bound:
        loop = asyncio.get_running_loop()
        pendants = []
        for begin in (said(Subscribe(1, 100.0)), said()):
            pendant = socket.create_connection(("127.0.0.1", bound.pendant))
            pendant.setblocking(False)
            await loop.sock_sendall(pendant, begin)
            pendants.append(pendant)
            # Until it is welcome.
            assert await loop.sock_recv(pendant, 65_536)
        talking, idle = app.clients.by_session
        sys.stdout.write(f"{len(app.clients.by_session)}\n")
        sys.stdout.flush()
        pulling = loop.run_in_executor(None, sys.stdin.read)
        while not pulling.done():
            # Read, so that it is the cable alone that ends it.
            await loop.sock_recv(pendants[0], 65_536)
        loopback("down")
        pulled, gone = time.monotonic(), dict[int, float]()
        while len(gone) < 2 and time.monotonic() < pulled + _PATIENCE:
            await asyncio.sleep(0.01)
            for session in {talking, idle} - set(app.clients.by_session) - set(gone):
                gone[session] = time.monotonic() - pulled
        loopback("up")
        sys.stdout.write(f"{gone[talking]} {gone[idle]}\n")


asyncio.run(main())
