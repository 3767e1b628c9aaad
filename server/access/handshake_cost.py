"""Cost of a TLS handshake: what its dearest step takes of the event loop's processor (promise 53).

OpenSSL signs with the server's key in one call, which no turn of the loop can divide. A key that
takes longer than a turn may lets any host hold up every robot, so that it is named at the start.
"""

from __future__ import annotations

import ssl
import time
from collections.abc import Callable
from contextlib import suppress

MOST_NS = 2_000_000
"""Greatest cost of a step that nothing is said of [ns]."""

_TRIES = 5
_STEPS = 4


def cost_warnings(
    context: ssl.SSLContext,
    certificate: str,
    processor_time: Callable[[], int] = time.thread_time_ns,
) -> tuple[str, ...]:
    """Return what is to be said of a certificate whose handshake costs too much.

    Args:
        certificate: name of its file.
    """
    cost = min(dearest_step(context, processor_time) for _ in range(_TRIES))
    if cost <= MOST_NS:
        return ()
    return (
        f"{certificate}: a step of its TLS handshake takes {cost / 1e6:.1f} ms of the processor;"
        f" accepted: {MOST_NS / 1e6:.0f} ms, or whoever connects holds up the robots; use a key on"
        " the curve P-256 (openssl ecparam -name prime256v1 -genkey)",
    )


def dearest_step(
    context: ssl.SSLContext, processor_time: Callable[[], int] = time.thread_time_ns
) -> int:
    """Shake hands with a client in memory; return what the dearest step of the server cost [ns]."""
    stranger = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    stranger.check_hostname = False
    stranger.verify_mode = ssl.CERT_NONE
    to_server, to_client = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = stranger.wrap_bio(to_client, to_server)
    server = context.wrap_bio(to_server, to_client, server_side=True)
    dearest = 0
    for _ in range(_STEPS):
        with suppress(ssl.SSLWantReadError):
            client.do_handshake()
        began = processor_time()
        # A server that asks for a certificate refuses this client, after it has signed.
        with suppress(ssl.SSLError):
            server.do_handshake()
        dearest = max(dearest, processor_time() - began)
    return dearest
