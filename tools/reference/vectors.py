"""Exported test vectors: packets of our own encoder, in the format of `tests/vectors`."""

from __future__ import annotations

import json
from collections.abc import Iterator

from openpendant.simplemsg import DIALECTS, PENDANT, ByteOrder, Codec, Dialect, Message, codec_for
from openpendant.simplemsg.packet_text import packet_to_json

from .messages import NOTICE, filter_name, own_messages
from .samples import extremes, sample, zeros

SOURCE = "openpendant's own encoder"
"""What each entry names as its maker: such packets prove no agreement with anybody else."""

_ORDERS = {"le": ByteOrder.LITTLE, "be": ByteOrder.BIG}


def vector_files() -> dict[str, str]:
    """Return every file of vectors: its name and its text."""
    files = {
        f"{dialect.name}-{order}-f{8 * real_size}.json": _file(
            dialect, codec_for(dialect, byte_order, real_size)
        )
        for dialect in DIALECTS.values()
        for order, byte_order in _ORDERS.items()
        for real_size in (4, 8)
    }
    return {"README.md": _README, **files}


def _file(dialect: Dialect, codec: Codec) -> str:
    entries = [_entry(name, message, codec) for name, message in _packets(dialect)]
    return "[\n" + ",\n".join(entries) + "\n]\n"


def _packets(dialect: Dialect) -> Iterator[tuple[str, Message]]:
    for cls in own_messages(dialect):
        name = filter_name(cls)
        yield f"{name}/sample", sample(cls)
        if dialect is PENDANT and cls.FIELDS:
            yield f"{name}/zeros", zeros(cls)
            yield f"{name}/extremes", extremes(cls)


def _entry(name: str, message: Message, codec: Codec) -> str:
    packet = packet_to_json(message, codec)
    entry = {
        "name": name,
        **{key: packet[key] for key in ("msg_type", "comm_type", "reply_code")},
        "source": SOURCE,
        "fields": packet["fields"],
        "hex": codec.encode(message).hex(),
    }
    return json.dumps(entry, ensure_ascii=False)


_README = f"""\
<!-- {NOTICE} -->

# Test vectors of every message

These packets were made by openpendant's own encoder from the declarations. They let another
implementation of the pendant messages be checked without a server. They do **not** show that
openpendant agrees with anybody else about the standard and Motoman messages: the packets in
`tests/vectors` do, which came out of other programs.

Each file is a JSON list for one dialect, byte order (`le`, `be`) and width of reals (`f32`,
`f64`). An entry has:

- `name`: unique in its file. `sample` holds in its k-th field 10 + k, or the field's first
  named value, or the field's name; `zeros` and `extremes` (pendant messages only) the ends.
- `msg_type`, `comm_type`, `reply_code`: the header.
- `source`: who made it.
- `fields`: what a decoder has to find; not-a-number and the infinities are `"nan"`, `"inf"`,
  `"-inf"`. An array's count that travels (`size`, `count`) is a field too. The JSON body of
  `management` is in hexadecimal.
- `hex`: the whole packet with its length.
"""
