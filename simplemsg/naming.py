"""Names of the values that integer fields can take, from their declarations."""

from __future__ import annotations

from enum import IntEnum, IntFlag

from .declaration import Field, Int


def value_name(field: Field, value: object) -> str | None:
    """Return the name of a field's value, such as `BUSY` or `TIME|POSITION`.

    Args:
        field: its declaration.
        value: as decoded.

    Returns:
        None where the field's values have no names, or this one has none. Bits without a name are
        added to the others in hexadecimal, as in `TIME|0x30`.
    """
    if not isinstance(field, Int) or field.values is None or not isinstance(value, int):
        return None
    if issubclass(field.values, IntFlag):
        return _bits(field.values, value)
    return _member(field.values, value)


def _member(values: type[IntEnum], value: int) -> str | None:
    try:
        return values(value).name
    except ValueError:
        return None


def _bits(flags: type[IntFlag], value: int) -> str | None:
    # A negative number has no end of bits; on the wire there are 32.
    rest = value & 0xFFFF_FFFF
    names: list[str] = []
    for bit in flags:
        if rest & bit:
            names.append(str(bit.name))
            rest &= ~int(bit)
    if not names:
        return None
    return "|".join([*names, f"0x{rest:x}"] if rest else names)
