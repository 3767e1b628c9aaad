"""Takes the network away for as long as one probe of an idle connection, and tells what is left.

Run in a network of its own (`unshare --net`), whose loopback it takes down. Prints `up` or `down`
for each of two connections: one as the server keeps pendants, one as it keeps the controller.
"""

import socket
import subprocess
import sys
import time

from openpendant.server.shell.socket_options import (
    CONTROLLER_UNANSWERED,
    PENDANT_UNANSWERED,
    prepare_socket,
)


def loopback(state: str) -> None:
    subprocess.run(["ip", "link", "set", "lo", state], check=True)


def is_up(connection: socket.socket) -> bool:
    connection.setblocking(False)
    try:
        return connection.recv(1) != b""
    except BlockingIOError:
        return True
    except OSError:
        return False


loopback("up")
began = time.monotonic()
listening = socket.create_server(("127.0.0.1", 0))
connections, peers = [], []
for unanswered in (PENDANT_UNANSWERED, CONTROLLER_UNANSWERED):
    connections.append(socket.create_connection(listening.getsockname()))
    prepare_socket(connections[-1], unanswered)
    peers.append(listening.accept())
time.sleep(began + 0.7 - time.monotonic())
loopback("down")
time.sleep(0.9)
loopback("up")
# Both are probed for the second time when two seconds are over, and the pendant's ends then.
while is_up(connections[0]) and time.monotonic() < began + 4.1:
    time.sleep(0.02)
time.sleep(0.15)
sys.stdout.write(" ".join("up" if is_up(each) else "down" for each in connections))
