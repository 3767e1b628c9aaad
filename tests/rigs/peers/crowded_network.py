"""A server with accounts, and hosts that hold all they get of it and connect 1,000 times a second.

Run in a network of its own (`unshare --net`), whose loopback has an address for each host. Reads
how many hosts there are; then for each further line it has a stranger stop the robot and a teacher
log in, each from an address that was not there before, and prints how long that took, as JSON:
`stop` and `login` from connect to verdict, `check` one password check of another process beside
that login, at the priority of the server's, `idle` how late a sleep ended [ms], and `began` [ns].
Ends with its input.
"""

import contextlib
import errno
import json
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path

from rigs.peers.server_clients import hello
from rigs.processes.guarded_server import PASSWORDS, add_accounts

from openpendant.server.access.passwords import DEFAULT_COST, SALT_BYTES, Secret, hash_password
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    Login,
    LoginKind,
    SoftwareStop,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode

SERVER, PORT = "10.54.0.1", 12_000
CONNECTS = 1_000
"""A second, of each host."""

_NICENESS = 10  # of the server's thread for passwords
_STARTED_WITHIN = 60.0
_ANSWERED_WITHIN = 30.0


def ip(*arguments: str) -> None:
    subprocess.run(["ip", *arguments], check=True)


def connected(address: str, within: float = _ANSWERED_WITHIN) -> socket.socket:
    return socket.create_connection((SERVER, PORT), within, (address, 0))


def is_open(sock: socket.socket) -> bool:
    """Return True if the server has not closed a connection; else close it, too."""
    try:
        while sock.recv(4_096):
            pass
    except BlockingIOError:
        return True
    except OSError:  # reset, or refused by the system
        pass
    sock.close()
    return False


def flood(address: str) -> None:
    """Connect all the time, say hello, and hold what one gets; ends when it is killed."""
    greeting = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE).send(hello("a host"))
    fresh, held = deque[socket.socket](), deque[socket.socket]()
    due = time.monotonic()
    while True:
        sock = socket.socket()
        sock.setblocking(False)
        sock.bind((address, 0))
        if sock.connect_ex((SERVER, PORT)) in (0, errno.EINPROGRESS):
            fresh.append(sock)
            with contextlib.suppress(OSError):
                sock.send(greeting)
        else:
            sock.close()
        # What is closed at once is, after a tenth of a second; of what is held one is looked at.
        if len(fresh) > CONNECTS // 10 and is_open(fresh[0]):
            held.append(fresh.popleft())
        elif len(fresh) > CONNECTS // 10:
            fresh.popleft()
        if held and is_open(held[0]):
            held.rotate(-1)
        elif held:
            held.popleft()
        due += 1.0 / CONNECTS
        time.sleep(max(due - time.monotonic(), 0.0))


def check() -> None:
    """For each line hash a password and print how long that took [s]."""
    os.nice(_NICENESS)
    for _ in sys.stdin:
        began = time.monotonic()
        hash_password(Secret("a long enough password"), os.urandom(SALT_BYTES), DEFAULT_COST)
        sys.stdout.write(f"{time.monotonic() - began}\n")
        sys.stdout.flush()


def accepted(address: str, *messages: Message) -> float:
    """Connect, say all, and wait until the last is accepted; return how long that took [ms]."""
    wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
    began = time.monotonic()
    with connected(address) as sock:
        sock.sendall(b"".join(map(wire.send, messages)))
        while True:
            data = sock.recv(65_536)
            assert data, "the server hung up"
            for told in wire.receive(data):
                if isinstance(told, Verdict):
                    assert told.code == VerdictCode.ACCEPTED, told
                    return (time.monotonic() - began) * 1e3


def trial(number: int, checker: subprocess.Popen[str]) -> dict[str, float]:
    stranger, teacher = f"10.54.2.{number}", f"10.54.3.{number}"
    for address in (stranger, teacher):
        ip("addr", "add", f"{address}/32", "dev", "lo")
    began = time.monotonic_ns()
    stop = accepted(stranger, hello("a stranger"), SoftwareStop(1, "stop"))
    assert checker.stdin is not None
    assert checker.stdout is not None
    checker.stdin.write("\n")
    checker.stdin.flush()
    password = Login(1, LoginKind.PASSWORD, "ann", PASSWORDS["ann"])
    login = accepted(teacher, hello("a teacher"), password)
    checked = float(checker.stdout.readline()) * 1e3
    slept = time.monotonic()
    time.sleep(0.01)
    idle = (time.monotonic() - slept) * 1e3 - 10.0
    return {"began": began, "stop": stop, "login": login, "check": checked, "idle": idle}


@contextlib.contextmanager
def ended_with_this(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, *arguments], text=True, **pipes) as process:  # type: ignore[call-overload]
        try:
            yield process
        finally:
            process.kill()


def await_server() -> None:
    until = time.monotonic() + _STARTED_WITHIN
    while True:
        try:
            connected(SERVER).close()
        except ConnectionRefusedError:
            assert time.monotonic() < until, "no server"
            time.sleep(0.1)
        else:
            return


def main() -> None:
    ip("link", "set", "lo", "up")
    ip("addr", "add", f"{SERVER}/32", "dev", "lo")
    hosts = [f"10.54.1.{number}" for number in range(1, int(sys.stdin.readline()) + 1)]
    for host in hosts:
        ip("addr", "add", f"{host}/32", "dev", "lo")
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        add_accounts(folder / "store.db", DEFAULT_COST)
        config = folder / "cell.toml"
        config.write_text(
            f'robot = "ur5"\nstore.path = "{folder / "store.db"}"\n'
            f'[listen]\nhost = "{SERVER}"\npendant_port = {PORT}\n'
            'ros_motion_port = "off"\nros_state_port = "off"\n',
            "utf-8",
        )
        stack.enter_context(
            ended_with_this("-m", "openpendant.tools", "serve", "--config", str(config))
        )
        checker = stack.enter_context(ended_with_this(__file__, "check"))
        await_server()
        for host in hosts:
            stack.enter_context(ended_with_this(__file__, "flood", host))
        time.sleep(1.0)
        for number, _ in enumerate(sys.stdin, 1):
            sys.stdout.write(json.dumps(trial(number, checker)) + "\n")
            sys.stdout.flush()


match sys.argv[1:]:
    case ["flood", own]:
        flood(own)
    case ["check"]:
        check()
    case _:
        main()
