"""What the sockets of connections are set to, and when each counts as dead.

A leaf: it needs nothing but the standard library.
"""

import socket

PENDANT_UNANSWERED = 1_500
"""Longest silence of a pendant's network stack [ms]: one lost probe ends an idle connection."""

CONTROLLER_UNANSWERED = 2_500
"""Longest silence of the controller's network stack [ms]: one lost probe ends no idle link.

Motion and stop link are idle between motions; in a motion, replies and feedback have far shorter
deadlines of their own.
"""


def prepare_socket(sock: socket.socket, unanswered: int) -> None:
    """Send at once, keep little in the kernel, and find a dead peer within a few seconds.

    Args:
        unanswered: how long what is sent, a probe of an idle connection too, may stay unanswered
            [ms]. An idle connection is probed each second: up to 2,000 it ends with the first
            probe that is lost, beyond with the second.
    """
    if sock.family not in (socket.AF_INET, socket.AF_INET6):
        return
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 8 * 1024)
    for option, value in (
        ("TCP_KEEPIDLE", 1),
        ("TCP_KEEPINTVL", 1),
        ("TCP_KEEPCNT", 2),
        ("TCP_USER_TIMEOUT", unanswered),
    ):
        number = getattr(socket, option, None)
        if number is not None:
            sock.setsockopt(socket.IPPROTO_TCP, number, value)
