"""XML files of unknown origin: one element tree read within bounds, and numbers in it.

Owns the bounds: file size, number and depth of elements, no document type (so no entities). Knows
nothing of robots beyond `RobotFileError`, which it raises for anything else.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

from ..bounded_file import read_bounded
from ..errors import RobotFileError

MAX_XML_BYTES = 8 << 20
MAX_ELEMENTS = 50_000
MAX_XML_DEPTH = 64

# Python's own float() would also take 1_000, infinity and nan.
_NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]+)?")


def read_xml(path: Path) -> ElementTree.Element:
    """Read a file's root element.

    Args:
        path: the file; no more than 8 MiB of it is read.

    Raises:
        RobotFileError: the file cannot be read, is too large or too deep, declares a document
            type, or is not well-formed XML.
    """
    raw = read_bounded(path, MAX_XML_BYTES, RobotFileError)
    _refuse_hostile_structure(raw, str(path))
    return ElementTree.fromstring(raw)


def _refuse_hostile_structure(raw: bytes, file: str) -> None:
    # Events are flat, so this pass can neither recurse nor expand an entity; building the tree
    # comes after it.
    parser = expat.ParserCreate()
    depth = count = 0

    def at_line(problem: str) -> RobotFileError:
        return RobotFileError(file, f"line {parser.CurrentLineNumber}", problem)

    def refuse_document_type(*_: object) -> None:
        raise at_line("declares a document type (DTD); accepted: XML without one")

    def enter(*_: object) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > MAX_XML_DEPTH:
            raise at_line(f"nests deeper than {MAX_XML_DEPTH} elements")
        if count > MAX_ELEMENTS:
            raise at_line(f"has more than {MAX_ELEMENTS} elements")

    def leave(_: object) -> None:
        nonlocal depth
        depth -= 1

    parser.StartDoctypeDeclHandler = refuse_document_type
    parser.StartElementHandler = enter
    parser.EndElementHandler = leave
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        raise RobotFileError(file, "", f"is not well-formed XML: {error}") from error
    except (ValueError, LookupError) as error:
        raise RobotFileError(file, "", f"is in an encoding that cannot be read: {error}") from error


def numbers(
    element: ElementTree.Element, attribute: str, count: int, file: str, where: str
) -> tuple[float, ...] | None:
    """Return the numbers an attribute lists; None if the element has no such attribute."""
    text = element.get(attribute)
    if text is None:
        return None
    parts = text.split()
    values = tuple(float(part) for part in parts if _NUMBER.fullmatch(part))
    if len(values) != len(parts) or len(parts) != count or not all(map(math.isfinite, values)):
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        shown = text if len(text) <= 60 else text[:57] + "..."
        raise RobotFileError(file, f"{where}.{attribute}", f"is {shown!r}; accepted: {wanted}")
    return values


def number(element: ElementTree.Element, attribute: str, file: str, where: str) -> float | None:
    """Return the number an attribute holds; None if the element has no such attribute."""
    values = numbers(element, attribute, 1, file, where)
    return None if values is None else values[0]
