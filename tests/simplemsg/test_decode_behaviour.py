import re
from pathlib import Path
from typing import Any

import pytest
from rigs.data.golden_vectors import exact, load

from openpendant.simplemsg import BodyFault, HeaderFault, Message, MessageFault, Opaque, codec_for
from openpendant.simplemsg.packet_text import packet_to_json

ENTRIES = load("decode-behaviour-le-f32")
REFERENCE = Path(__file__).parents[2] / "docs" / "simplemsg.md"
HEADING = "## Where this differs from the C++ library"


def _listed_deviations() -> set[str]:
    section = REFERENCE.read_text(encoding="utf-8").split(HEADING, 1)[1].split("\n## ", 1)[0]
    return set(re.findall(r"^\| `([a-z_]+/[^`]+)` \|", section, flags=re.MULTILINE))


def _decode(entry: dict[str, Any]) -> Message | MessageFault:
    try:
        return codec_for().decode(bytes.fromhex(entry["hex"]))
    except MessageFault as fault:
        return fault


def _behaves_like_the_library(entry: dict[str, Any]) -> bool:
    """Compare acceptance of the header, acceptance of the body, and the values read."""
    decoded, typed = _decode(entry), entry["typed_decode"]
    if not entry["message_accepted"]:
        return isinstance(decoded, HeaderFault)
    if typed is False:
        return isinstance(decoded, BodyFault)
    if isinstance(decoded, MessageFault) or isinstance(decoded, Opaque) != (typed is None):
        return False
    if not isinstance(typed, dict):
        return True
    return exact(packet_to_json(decoded, codec_for())["fields"]) == exact(typed)


def test_the_deviating_inputs_are_exactly_those_that_the_documentation_lists() -> None:
    deviating = {entry["name"] for entry in ENTRIES if not _behaves_like_the_library(entry)}
    assert deviating == _listed_deviations()


@pytest.mark.parametrize(
    "entry",
    [entry for entry in ENTRIES if entry["name"].startswith("joint_position/extra")],
    ids=lambda entry: entry["name"],
)
def test_a_body_that_is_too_long_is_refused_with_both_sizes(entry: dict[str, Any]) -> None:
    with pytest.raises(BodyFault, match="the body has 48 bytes, not 44"):
        codec_for().decode(bytes.fromhex(entry["hex"]))
