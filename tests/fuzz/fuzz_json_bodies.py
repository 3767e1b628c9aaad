"""JSON from outside: management bodies are always answered, packets are read or refused."""

import json
from collections.abc import Iterator

from rigs.cells.server_rig import ready
from rigs.data.golden_vectors import GOLDEN
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg import DIALECTS, ProtocolError, ReplyCode, codec_for
from openpendant.simplemsg.packet_text import packet_from_json, packet_to_json
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Management

from .choices import Choices

_DIALECTS = tuple(DIALECTS.values())
_PENDANT: Pendant = ready().pendant()
"""A management request changes nothing, so one conversation serves all inputs."""


def TestOneInput(data: bytes) -> None:
    choices = Choices(data)
    dialect, real_size = choices.pick(_DIALECTS), choices.pick((4, 8))
    body = choices.rest()
    _PENDANT.got.clear()
    (reply,) = _PENDANT.send(Management(7, body))
    assert isinstance(reply, Management)
    assert reply.request_id == 7
    assert reply.reply_code in (ReplyCode.SUCCESS, ReplyCode.FAILURE)
    assert len(reply.body) < MAX_PENDANT_FRAME - 100
    assert isinstance(json.loads(reply.body), dict)

    try:
        value = json.loads(body)
    except (ValueError, RecursionError):
        return
    codec = codec_for(dialect, real_size=real_size)
    try:
        frame = codec.encode(packet_from_json(value, codec))
        again = codec.decode(frame)
    except ProtocolError:
        return
    # Not the frame itself: what is masked on receipt is gone.
    frame = codec.encode(again)
    assert codec.encode(packet_from_json(packet_to_json(again, codec), codec)) == frame


def seeds() -> Iterator[bytes]:
    yield b'\x00\x00{"op": "snapshot"}'
    yield b'\x00\x00{"op": 7, "also": [1e400, NaN]}'
    for golden in GOLDEN[::17]:
        packet = packet_to_json(golden.codec.decode(golden.frame), golden.codec)
        head = bytes((_DIALECTS.index(golden.dialect), golden.real_size // 8))
        yield head + json.dumps(packet).encode()
