"""A relay between gateway and server that spoils what the server says."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Any

from browser.loopback_relay import LoopbackRelay
from openpendant.simplemsg.pendant import Management, State

STATE = State.PLACE.msg_type
MANAGEMENT = Management.PLACE.msg_type
_HEADER = 16
_BODY = 20
"""Where the JSON of an answer begins: behind the header and the id of its request."""

Spoil = Callable[[bytes], bytes]


def kind_of(frame: bytes) -> int:
    """Return the message type of a frame."""
    return int.from_bytes(frame[4:8], "little")


def framed(frame: bytes, body: bytes) -> bytes:
    """Return a frame with the header of another one and a body of its own."""
    return (_HEADER - 4 + len(body)).to_bytes(4, "little") + frame[4:_HEADER] + body


def with_answer(frame: bytes, change: Callable[[dict[str, Any]], dict[str, Any]]) -> bytes:
    """Return an answer whose data were changed; any other frame as it is."""
    if kind_of(frame) != MANAGEMENT:
        return frame
    data = change(json.loads(frame[_BODY:]))
    return framed(frame, frame[_HEADER:_BODY] + json.dumps(data).encode())


class SpoilingRelay(LoopbackRelay):
    """Hands on each frame of the server as `spoil` makes it; as it is where that is None."""

    def __init__(self, target: int) -> None:
        """Begin honestly."""
        self.spoil: Spoil | None = None
        super().__init__(target)

    def spoil_once(self, spoil: Spoil, kind: int) -> None:
        """Spoil the next frame of a type, and then be honest again."""

        def once(frame: bytes) -> bytes:
            if kind_of(frame) != kind:
                return frame
            self.spoil = None
            return spoil(frame)

        self.spoil = once

    async def _carry(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, *, is_noted: bool
    ) -> None:
        if is_noted:
            await super()._carry(reader, writer, is_noted=True)
            return
        left = b""
        try:
            while data := await reader.read(65536):
                await self._flows.wait()
                left += data
                while len(left) >= 4 and (size := 4 + int.from_bytes(left[:4], "little")) <= len(
                    left
                ):
                    frame, left = left[:size], left[size:]
                    spoil = self.spoil
                    writer.write(frame if spoil is None else spoil(frame))
        except ConnectionError:
            return
        finally:
            writer.close()
