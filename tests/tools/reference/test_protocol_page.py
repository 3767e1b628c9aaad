import re

import pytest
from rigs.data.case_table import every

from openpendant.simplemsg import ByteOrder, Message, codec_for
from openpendant.simplemsg.codec import DIALECTS
from openpendant.simplemsg.declaration import Array, CountPlace, Tail
from openpendant.simplemsg.motoman_catalogue import CATALOGUE as MOTOMAN_CATALOGUE
from openpendant.simplemsg.standard import JointTraj, JointTrajPtFull
from openpendant.simplemsg.verdicts import CATALOGUE as VERDICTS
from openpendant.tools.reference.messages import ALL_MESSAGES, filter_name
from openpendant.tools.reference.page import frame_fields, frame_size, protocol_page
from openpendant.tools.reference.samples import sample

PAGE = protocol_page()

MESSAGES = [(cls.__name__, cls) for cls in ALL_MESSAGES]


def _section(cls: type[Message]) -> str:
    title = f"### {int(cls.PLACE.msg_type)} {filter_name(cls)}\n"
    assert PAGE.count(title) == 1
    return PAGE.partition(title)[2].partition("\n##")[0]


def test_every_section_has_every_field_once() -> None:
    every(MESSAGES, _has_every_field_once)


def _has_every_field_once(cls: type[Message]) -> None:
    section = _section(cls)
    for row in frame_fields(cls, 4):
        assert section.count(f"| {row.offset} | {row.kind} | `{row.name}` |") == 1, row.name


def test_every_example_is_the_sample_in_bytes() -> None:
    every(MESSAGES, _has_its_sample_in_bytes)


def _has_its_sample_in_bytes(cls: type[Message]) -> None:
    block = _section(cls).partition("```text\n")[2].partition("```")[0].partition("\n\n")[0]
    dialect = next(one for one in DIALECTS.values() if cls in one.messages)
    frame = bytes.fromhex(re.sub(r"\s", "", block))
    assert codec_for(dialect, ByteOrder.LITTLE).decode(frame) == sample(cls)


@pytest.mark.parametrize("real_size", [4, 8])
def test_the_last_offset_and_the_size_agree_with_the_codec(real_size: int) -> None:
    every([(name, (cls, real_size)) for name, cls in MESSAGES], _agrees_with_the_codec)


def _agrees_with_the_codec(case: tuple[type[Message], int]) -> None:
    cls, real_size = case
    dialect = next(one for one in DIALECTS.values() if cls in one.messages)
    length = len(codec_for(dialect, ByteOrder.LITTLE, real_size).encode(sample(cls)))
    numbers = [int(number) for number in re.findall(r"\d+", frame_size(cls, real_size))]
    last = list(cls.FIELDS.values())[-1] if cls.FIELDS else None
    if isinstance(last, Tail):
        assert numbers == [length - len(getattr(sample(cls), list(cls.FIELDS)[-1]))]
    elif isinstance(last, Array) and last.least != last.most:
        records = getattr(sample(cls), list(cls.FIELDS)[-1])
        assert numbers[0] + numbers[1] * len(records) == length
    else:
        assert numbers == [length]


def test_offsets_are_those_of_the_wire_reference() -> None:
    offsets = {row.name: row.offset for row in frame_fields(JointTrajPtFull, 4)}
    assert offsets == {
        "robot_id": "16",
        "sequence": "20",
        "valid_fields": "24",
        "time": "28",
        "positions": "32",
        "velocities": "72",
        "accelerations": "112",
    }


def test_a_count_behind_its_records_lies_behind_them() -> None:
    assert [(row.offset, row.name) for row in frame_fields(JointTraj, 4)] == [
        ("16 + 52 i", "points[i].sequence"),
        ("20 + 52 i", "points[i].joints"),
        ("60 + 52 i", "points[i].velocity"),
        ("64 + 52 i", "points[i].duration"),
        ("16 + 52 n", "size"),
    ]
    (array,) = JointTraj.FIELDS.values()
    assert isinstance(array, Array)
    assert array.count_place is CountPlace.AFTER


def test_every_code_stands_on_the_page_with_its_remedy() -> None:
    for entries in (VERDICTS, *MOTOMAN_CATALOGUE.values()):
        for member, entry in entries.items():
            row = f"| {int(member)} | `{member.name}` | {entry.cause} | {entry.remedy} |"
            assert row in PAGE


def test_every_link_inside_the_page_has_its_target() -> None:
    headings = re.findall(r"^#+ (.*)$", PAGE, flags=re.MULTILINE)
    anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    assert set(re.findall(r"\]\(#([^)]*)\)", PAGE)) <= anchors
