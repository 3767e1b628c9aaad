"""A program that computes, and so does not serve its event loop for a while; virtual clock."""

import asyncio


def hang(seconds: float) -> None:
    """Let time pass without the event loop, as a program does that computes."""
    loop = asyncio.get_running_loop()
    loop._selector.now_ns += round(seconds * 1e9)  # type: ignore[attr-defined]
