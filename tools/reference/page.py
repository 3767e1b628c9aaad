"""The reference page, every message to the byte with an example, and the page of the codes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import IntEnum, IntFlag
from typing import Any

from openpendant.simplemsg import DIALECTS, MOTOMAN, ByteOrder, Codec, Message, codec_for
from openpendant.simplemsg.declaration import (
    Array,
    CountPlace,
    Int,
    Record,
    Reply,
    Topic,
    value_name,
)
from openpendant.simplemsg.frame_fields import FrameField, frame_fields, frame_size
from openpendant.simplemsg.motoman_addresses import AREAS, WRITABLE_REGISTERS, ControllerModel
from openpendant.simplemsg.motoman_catalogue import CATALOGUE as MOTOMAN_CATALOGUE
from openpendant.simplemsg.packet_text import packet_to_json
from openpendant.simplemsg.verdicts import CATALOGUE as VERDICTS
from openpendant.simplemsg.verdicts import CatalogueEntry, VerdictCode

from .messages import NOTICE, filter_name, own_messages
from .prose import FRAMING, INTRODUCTION, PENDANT_RULES, PROSE_OF_DIALECTS
from .samples import sample

_MOST_NAMES = 12
_HEX_BYTES_A_LINE = 32
_KINDS_OF_CODES = {
    "MotionCommand": "Motion commands (2001)",
    "MotionResult": "Results (2002)",
    "Subcode": "Subcodes (2002)",
    "IoResult": "Results of I/O and registers (2004 to 2013)",
}


def protocol_page() -> str:
    """Return the whole page, in Markdown."""
    parts = [f"<!-- {NOTICE} -->", "", INTRODUCTION, _overview(), FRAMING, PENDANT_RULES]
    for dialect in DIALECTS.values():
        parts.append(f"## Messages of `{dialect.name}`\n")
        parts.append(PROSE_OF_DIALECTS[dialect.name])
        codec = codec_for(dialect, ByteOrder.LITTLE)
        parts += [_message(cls, codec) for cls in own_messages(dialect)]
        if dialect is MOTOMAN:
            parts += [_motoman_codes(), _addresses()]
    parts.append(_verdicts())
    return "\n".join(parts)


def _overview() -> str:
    rows = [
        (
            str(int(cls.PLACE.msg_type)),
            f"[`{cls.PLACE.name}`](#{_anchor(cls)})",
            f"`{dialect.name}`",
            _usual(cls),
            cls.PLACE.direction.value,
            cls.PLACE.about,
        )
        for dialect in DIALECTS.values()
        for cls in own_messages(dialect)
    ]
    heads = ("type", "name", "dialect", "usually", "way", "what it is for")
    return "\n".join([*_table(heads, rows), ""])


def _anchor(cls: type[Message]) -> str:
    return f"{int(cls.PLACE.msg_type)}-{filter_name(cls)}"


def _usual(cls: type[Message]) -> str:
    return "reply" if issubclass(cls, Reply) else "topic" if issubclass(cls, Topic) else "request"


def _message(cls: type[Message], codec: Codec) -> str:
    place = cls.PLACE
    lines = [
        f"### {int(place.msg_type)} {filter_name(cls)}",
        "",
        place.about,
        "",
        f"- Way: {place.direction.value}, usually as a {_usual(cls)}. Reply: {place.reply}.",
        f"- Frame: {_sizes(cls)}. Source: {place.source}.",
        *([f"- Since version {place.since} of the pendant protocol."] if place.since > 2 else []),
        "",
    ]
    rows = frame_fields(cls, 4)
    if rows:
        heads = ("offset", "type", "field", "unit", "meaning")
        lines += [*_table(heads, [_cells(row) for row in rows]), ""]
    remarks = [*_array_sentences(cls), *_values(rows)]
    if remarks:
        lines += [*(f"- {remark}" for remark in remarks), ""]
    return "\n".join([*lines, *_example(cls, codec)])


def _sizes(cls: type[Message]) -> str:
    four, eight = frame_size(cls, 4), frame_size(cls, 8)
    return four if four == eight else f"{four}; with reals of 8 bytes: {eight}"


def _cells(row: FrameField) -> tuple[str, ...]:
    unit = row.field.unit if row.field is not None else ""
    meaning = row.meaning
    if isinstance(row.field, Int) and row.field.mask is not None:
        meaning += f"; a receiver keeps the bits {row.field.mask:#x}, others may hold anything"
    return row.offset, row.kind, f"`{row.name}`", unit, meaning


def _array_sentences(cls: type[Message]) -> list[str]:
    found = []
    for name, field in cls.FIELDS.items():
        if not isinstance(field, Array):
            continue
        number = str(field.most)
        if field.least != field.most:
            number = f"{field.least} to {field.most}"
        place = {
            CountPlace.NOWHERE: "their number is told by the size of the body",
            CountPlace.BEFORE: f"their number n stands before them, in `{field.count_name}`",
            CountPlace.AFTER: f"their number n stands behind them, in `{field.count_name}`",
        }[field.count_place]
        found.append(f"`{name}` has {number} records, i counted from 0; {place}.")
        if field.meant_by:
            found.append(
                f"There are exactly `{field.meant_by}` records, or {field.most}, of which the last"
                " are padding; any other number makes the message malformed."
            )
    return found


def _values(rows: Iterable[FrameField]) -> list[str]:
    """Return a sentence for each field with named values."""
    sentences = []
    for row in rows:
        if not isinstance(row.field, Int) or row.field.values is None:
            continue
        values = row.field.values
        kind = "bits" if issubclass(values, IntFlag) else "values"
        names = [f"{int(member)} {member.name}" for member in values]
        told = ", ".join(names) if len(names) <= _MOST_NAMES else f"see `{values.__name__}` below"
        sentences.append(f"`{row.name}` has named {kind}: {told}.")
    return sentences


def _example(cls: type[Message], codec: Codec) -> list[str]:
    message = sample(cls)
    frame = codec.encode(message).hex()
    width = 2 * _HEX_BYTES_A_LINE
    hexadecimal = [_words(frame[at : at + width]) for at in range(0, len(frame), width)]
    decoded = _decoded(packet_to_json(message, codec)["fields"], message)
    return [
        "Example, little-endian:",
        "",
        "```text",
        *hexadecimal,
        *(["", *decoded] if decoded else []),
        "```",
        "",
    ]


def _words(digits: str) -> str:
    return " ".join(digits[at : at + 8] for at in range(0, len(digits), 8))


def _decoded(fields: Mapping[str, Any], record: Record, margin: str = "") -> list[str]:
    """Return the fields of an example, one a line, with the names of values that have one."""
    lines = []
    for name, value in fields.items():
        field = record.FIELDS.get(name)
        if isinstance(field, Array):
            for index, inner in enumerate(getattr(record, name)):
                lines.append(f"{margin}{name}[{index}]")
                lines += _decoded(value[index], inner, margin + "  ")
            continue
        named = value_name(field, value) if field is not None else None
        lines.append(f"{margin}{name} = {_value(value)}" + (f" ({named})" if named else ""))
    return lines


def _value(value: Any) -> str:
    if not isinstance(value, list):
        return repr(value) if isinstance(value, str) else str(value)
    shown = [_value(one) for one in value[:4]]
    return f"[{', '.join(shown)}{', …' if len(value) > len(shown) else ''}]"


def _motoman_codes() -> str:
    lines: list[str] = []
    for kind, entries in MOTOMAN_CATALOGUE.items():
        lines += [f"### {_KINDS_OF_CODES[kind.__name__]}", "", f"`{kind.__name__}`", ""]
        lines += [*_code_table(entries), ""]
    return "\n".join(lines)


def _addresses() -> str:
    areas = {
        area.name: [one for found in AREAS.values() for one in found if one.name == area.name]
        for area in AREAS[ControllerModel.DX100]
    }
    rows = [
        (
            name,
            *(f"{area.first} to {area.last}" for area in found),
            "yes" if found[0].writable else "",
        )
        for name, found in areas.items()
    ]
    registers = f"0 to {WRITABLE_REGISTERS[-1]}"
    rows.append(("M register", *["0 to 999"] * len(ControllerModel), registers))
    heads = ("bits", *(controller.value for controller in ControllerModel), "may be written")
    return "\n".join(
        [
            "### Addresses of I/O and registers",
            "",
            "Bit addresses are decimal and end in 0 to 7; a group is the address without its last"
            " digit.",
            "A register is named by its number, or by its number + 1,000,000.",
            "",
            *_table(heads, rows),
            "",
        ]
    )


def _verdicts() -> str:
    return "\n".join(["## Verdict codes", "", "`VerdictCode`", "", *_code_table(VERDICTS), ""])


def _code_table(entries: Mapping[Any, CatalogueEntry]) -> list[str]:
    rows = [_code(member, entry) for member, entry in entries.items()]
    return _table(("number", "name", "meaning", "remedy"), rows)


def _code(member: IntEnum, entry: CatalogueEntry) -> tuple[str, ...]:
    return str(int(member)), f"`{member.name}`", entry.cause, entry.remedy


def _table(heads: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    titles = list(heads)
    return [
        f"| {' | '.join(titles)} |",
        f"| {' | '.join('---' for _ in titles)} |",
        *(f"| {' | '.join(cells)} |" for cells in rows),
    ]


_OPENING = """# Errors, and what to do about them

Every refusal and every aborted motion carries one of these codes, beside a sentence with the
numbers of the case: joint, value, limit. A code is never reused for something else. Link to one as
`errors.md#code-NUMBER`. What keeps a robot from moving right now, `openpendant why` tells.
"""


def error_page() -> str:
    """Return the page as Markdown."""
    parts = [f"<!-- {NOTICE} -->", "", _OPENING]
    for code in sorted(set(VerdictCode) - {VerdictCode.ACCEPTED}):
        entry = VERDICTS[code]
        parts += [
            f'<a id="code-{code.value}"></a>',
            f"## {code.value} {code.name}",
            "",
            f"**Cause.** {entry.cause}",
            "",
            f"**Remedy.** {entry.remedy}",
            "",
        ]
    return "\n".join(parts)
