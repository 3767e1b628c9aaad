"""What is published: pages, schemas, vectors, files. None is left out, nothing is made up."""

import inspect
import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from rigs.data.case_table import every, same
from rigs.data.golden_vectors import exact

from openpendant.simplemsg import DIALECTS, ByteOrder, Codec, Message, codec_for
from openpendant.simplemsg.declaration import Array, CountPlace, Int, Reals, Tail
from openpendant.simplemsg.frame_fields import frame_fields, frame_size
from openpendant.simplemsg.motoman_catalogue import CATALOGUE as MOTOMAN_CATALOGUE
from openpendant.simplemsg.packet_text import packet_from_json, packet_to_json
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import Role
from openpendant.simplemsg.standard import JointTraj, JointTrajPtFull
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode
from openpendant.simplemsg.verdicts import CATALOGUE as VERDICTS
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.reference import __main__, files
from openpendant.tools.reference.__main__ import main
from openpendant.tools.reference.files import generated_files, stale_files, write_files
from openpendant.tools.reference.messages import ALL_MESSAGES, every_field, filter_name
from openpendant.tools.reference.operations import PublishedOperation, published_operations
from openpendant.tools.reference.operations_page import operations_page
from openpendant.tools.reference.page import error_page, protocol_page
from openpendant.tools.reference.python_page import python_page
from openpendant.tools.reference.samples import extremes, sample, zeros
from openpendant.tools.reference.schemas import (
    field_rows,
    reply_schema,
    request_schema,
    schema_files,
)
from openpendant.tools.reference.vectors import vector_files

GENERATED = Path(__file__).parents[3] / "docs" / "generated"


@cache
def schemas() -> dict[str, Any]:
    return {name: json.loads(text) for name, text in schema_files().items()}


@cache
def page() -> str:
    return operations_page()


def test_every_operation_that_the_server_knows_is_published() -> None:
    assert set(published_operations()) == set(OPERATIONS)


def test_every_operation_has_a_schema_of_its_request_and_of_its_reply() -> None:
    kinds = [
        f"{name}-{kind}.json" for name in published_operations() for kind in ("request", "reply")
    ]
    assert set(schemas()) == {"failure-reply.json", *kinds}


def test_every_request_names_its_operation_and_refuses_unknown_keys() -> None:
    every(published_operations().items(), _names_its_operation_and_refuses_unknown_keys)


def _names_its_operation_and_refuses_unknown_keys(operation: PublishedOperation) -> None:
    schema = schemas()[f"{operation.name}-request.json"]
    assert schema["properties"]["op"]["const"] == operation.name
    assert "op" in schema["required"]
    assert schema["additionalProperties"] is False
    assert all(inner["additionalProperties"] is False for inner in _objects_inside(schema))


def _objects_inside(schema: dict[str, Any]) -> list[dict[str, Any]]:
    return [inner for inner in schema.get("$defs", {}).values() if inner["type"] == "object"]


def test_the_page_has_role_call_schemas_and_every_field_of_every_operation() -> None:
    every(published_operations().items(), _is_on_the_page_with_all_its_fields)


def _is_on_the_page_with_all_its_fields(operation: PublishedOperation) -> None:
    section = _section(operation.name)
    role = "anybody" if operation.role is None else operation.role.value
    assert f"Role: {role}" in section
    assert f"`pendant.{operation.usage}`" in section
    for kind in ("request", "reply"):
        link = f"schemas/{operation.name}-{kind}.json"
        assert link in section
        assert (GENERATED / link).is_file()
    for name in operation.told.section("Args"):
        assert re.search(rf"^\| `{name}` \| \S.* \| .* \| \S.* \|$", section, re.MULTILINE), name
    for row in field_rows(reply_schema(operation.reply), lambda *_: ""):
        assert f"\n| `{row.path}` | " in section, row.path


def _section(name: str) -> str:
    return page().partition(f"\n### {name}\n")[2].partition("\n### ")[0]


def test_no_field_is_without_a_meaning() -> None:
    rows = [line for line in page().splitlines() if line.startswith("| `")]
    assert len(rows) > 300
    assert [row for row in rows if row.endswith("|  |")] == []


@pytest.mark.parametrize(
    "tag", ["edit insert", "edit touch-up", "statement move", "statement wait"]
)
def test_edits_and_statements_have_sections_that_operations_link_to(tag: str) -> None:
    kind, value = tag.split()
    assert f'<a id="{kind}-{value}"></a>\n### {kind} `{value}`' in page()
    assert f"(#{kind}-{value})" in _section("programs.edit") + _section("programs.record") + page()


def test_every_link_of_the_page_leads_somewhere() -> None:
    headings = re.findall(r"^### (\S+)$", page(), re.MULTILINE)
    places = {re.sub(r"[^\w-]", "", name) for name in headings}
    places |= set(re.findall(r'<a id="([^"]+)">', page()))
    assert set(re.findall(r"\]\(#([^)]+)\)", page())) <= places
    codes = {int(number) for number in re.findall(r"errors\.md#code-(\d+)", page())}
    assert codes
    assert codes <= {code.value for code in VerdictCode}


def test_bounds_defaults_and_roles_are_those_of_the_server() -> None:
    play = _section("recordings.play")
    assert "| `factor` | number, 0.1 to 4.0 | `1.0` |" in play
    assert f"Role: {Role.OPERATOR.value} (`run-program`)" in play
    assert "| `repeats` | integer, 1 to " in play


def test_a_model_that_two_operations_share_is_published_for_each() -> None:
    for name in ("scene.allow", "scene.forbid"):
        assert request_schema(published_operations()[name])["properties"]["op"]["const"] == name


def test_a_key_that_may_be_missing_is_not_required() -> None:
    nearest = schemas()["scene.nearest-reply.json"]
    assert nearest["required"] == ["distance"]
    assert "default" not in nearest["properties"]["first"]


PROTOCOL_PAGE = protocol_page()

MESSAGES = [(cls.__name__, cls) for cls in ALL_MESSAGES]


def _message_section(cls: type[Message]) -> str:
    title = f"### {int(cls.PLACE.msg_type)} {filter_name(cls)}\n"
    assert PROTOCOL_PAGE.count(title) == 1
    return PROTOCOL_PAGE.partition(title)[2].partition("\n##")[0]


def test_every_section_has_every_field_once() -> None:
    every(MESSAGES, _has_every_field_once)


def _has_every_field_once(cls: type[Message]) -> None:
    section = _message_section(cls)
    for row in frame_fields(cls, 4):
        assert section.count(f"| {row.offset} | {row.kind} | `{row.name}` |") == 1, row.name


def test_every_example_is_the_sample_in_bytes() -> None:
    every(MESSAGES, _has_its_sample_in_bytes)


def _has_its_sample_in_bytes(cls: type[Message]) -> None:
    block = _message_section(cls).partition("```text\n")[2].partition("```")[0].partition("\n\n")[0]
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
            assert row in PROTOCOL_PAGE


def test_every_link_inside_the_page_has_its_target() -> None:
    headings = re.findall(r"^#+ (.*)$", PROTOCOL_PAGE, flags=re.MULTILINE)
    anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    assert set(re.findall(r"\]\(#([^)]*)\)", PROTOCOL_PAGE)) <= anchors


DOCS = Path(__file__).parents[3] / "docs"


@cache
def client_page() -> str:
    return python_page()


def client_section(path: str) -> str:
    return (
        client_page().partition(f"\n### {path}\n")[2].partition("\n### ")[0].partition("\n## ")[0]
    )


def test_every_call_of_the_client_itself_has_a_section() -> None:
    names = [name for name, _ in inspect.getmembers(PendantClient) if not name.startswith("_")]
    assert len(names) > 40
    assert [name for name in names if not client_section(f"pendant.{name}")] == []


def test_every_call_of_a_group_has_its_arguments_and_the_keys_of_its_reply() -> None:
    every(published_operations().items(), _has_its_arguments)


def _has_its_arguments(operation: PublishedOperation) -> None:
    told = client_section(
        ".".join(part for part in ("pendant", operation.group, operation.call) if part)
    )
    assert f"[`{operation.name}`](operations.md#{operation.name.replace('.', '')})" in told
    for each in operation.arguments:
        assert re.search(rf"^\| `{each.name}` \| \S.* \| .* \| \S.* \|$", told, re.MULTILINE)
    refused = operation.told.section("Raises").get("Refused", "")
    for code in re.findall(r"\b[A-Z]+_[A-Z_]+\b", refused):
        assert f"[{code}](../errors.md#code-{VerdictCode[code].value})" in told


def test_a_call_is_written_as_python_writes_it() -> None:
    assert "`await pendant.move_joints(joints, *, speed=0.1) -> MotionHandle`" in client_page()
    saving = "name, body, expected_revision, *, format='text', part=1, parts=1"
    assert f"`await pendant.programs.save({saving}) -> ProgramSaved`" in client_page()
    assert "| `part` | `int`, 1 to 1000 | `1` | Which part this is, from 1. |" in client_page()
    assert "`await pendant.retreat() -> list[Hold]`" in client_page()
    assert client_section("pendant.recordings.play").splitlines()[1].endswith("-> PlaybackHandle`")


def test_the_page_is_linked_from_the_guide() -> None:
    assert "(generated/python-client.md)" in (DOCS / "pendant-apps.md").read_text("utf-8")


SERVER = Path(__file__).parents[3] / "server"
CODES = sorted(set(VerdictCode) - {VerdictCode.ACCEPTED})


def test_every_code_has_an_anchor_cause_and_remedy() -> None:
    page = error_page()

    def check(code: VerdictCode) -> None:
        assert page.count(f'<a id="code-{code.value}"></a>\n## {code.value} {code.name}\n') == 1
        assert f"**Cause.** {CATALOGUE[code].cause}" in page
        assert f"**Remedy.** {CATALOGUE[code].remedy}" in page

    every([(code.name, code) for code in CODES], check)


def test_every_code_that_the_server_names_is_in_the_catalogue() -> None:
    named = {
        name
        for file in SERVER.rglob("*.py")
        for name in re.findall(r"\bVerdictCode\.([A-Z_]+)\b", file.read_text(encoding="utf-8"))
    }
    assert len(named) > 50
    assert named <= {code.name for code in CATALOGUE}


def test_every_refusal_of_the_server_is_made_with_a_code_of_the_catalogue() -> None:
    # A refusal takes its code as the first argument; a number or a text would be caught here.
    wild = [
        f"{file.name}: {call}"
        for file in SERVER.rglob("*.py")
        for call in re.findall(r"\bRefusal\(\s*([\d\"'f][^,)]*)", file.read_text(encoding="utf-8"))
        if re.match(r"[\d\"']|f[\"']", call)
    ]
    assert wild == []


def test_numbers_are_unique() -> None:
    assert len({code.value for code in VerdictCode}) == len(VerdictCode.__members__)


FILES = {name: text for name, text in vector_files().items() if name.endswith(".json")}


def _codec(file: str) -> Codec:
    dialect, order, real = file.removesuffix(".json").split("-")
    byte_order = ByteOrder.LITTLE if order == "le" else ByteOrder.BIG
    return codec_for(DIALECTS[dialect], byte_order, int(real[1:]) // 8)


def _packet(entry: dict[str, Any]) -> dict[str, Any]:
    return {key: entry[key] for key in ("msg_type", "comm_type", "reply_code", "fields")}


def test_there_is_a_file_for_each_dialect_order_and_width() -> None:
    assert len(FILES) == len(DIALECTS) * 2 * 2


@pytest.mark.parametrize("file", FILES)
def test_every_exported_packet_holds_both_ways(file: str) -> None:
    codec = _codec(file)

    def check(entry: dict[str, Any]) -> None:
        message = codec.decode(bytes.fromhex(entry["hex"]))
        decoded = {**packet_to_json(message, codec)}
        decoded.pop("name")
        same(exact(decoded), exact(_packet(entry)))
        same(codec.encode(packet_from_json(_packet(entry), codec)).hex(), entry["hex"])

    every([(entry["name"], entry) for entry in json.loads(FILES[file])], check)


@pytest.mark.parametrize("file", FILES)
def test_names_are_unique_in_a_file(file: str) -> None:
    names = [entry["name"] for entry in json.loads(FILES[file])]
    assert len(names) == len(set(names))


def test_the_fields_of_every_sample_can_be_told_apart() -> None:
    every(MESSAGES, _has_fields_that_can_be_told_apart)


def _has_fields_that_can_be_told_apart(cls: type[Message]) -> None:
    message = sample(cls)
    plain = [
        value
        for name, field in cls.FIELDS.items()
        if not (isinstance(field, Int) and field.values is not None)
        for value in [getattr(message, name)]
    ]
    assert all(one != other for i, one in enumerate(plain) for other in plain[:i])


def test_every_sample_is_exact_in_four_bytes() -> None:
    every(MESSAGES, _is_exact_in_four_bytes)


def _is_exact_in_four_bytes(cls: type[Message]) -> None:
    codecs = [_codec(f"{name}-le-f32") for name in DIALECTS]
    codec = next(codec for codec in codecs if cls in codec.dialect.messages)
    assert codec.decode(codec.encode(sample(cls))) == sample(cls)


def test_extremes_hold_what_is_no_number_and_zeros_do_not() -> None:
    cls = next(cls for cls in ALL_MESSAGES if cls.__name__ == "State")
    assert any(isinstance(field, Reals) for field in every_field(cls.FIELDS))
    assert "nan" in repr(extremes(cls))
    assert "nan" not in repr(zeros(cls))


@pytest.fixture(name="generated", scope="module")
def _generated() -> dict[str, str]:
    return generated_files()


@pytest.fixture(name="once")
def _once(generated: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Have what is written and compared generated once, since it comes out the same each time."""
    for module in (files, __main__):
        monkeypatch.setattr(module, "generated_files", lambda: generated)


@pytest.mark.usefixtures("once")
def test_no_generated_file_is_stale() -> None:
    stale = stale_files(DOCS)
    assert not stale, f"{'; '.join(stale)}. Run: make reference"


def test_generating_twice_gives_the_same_bytes(generated: dict[str, str]) -> None:
    assert generated_files() == generated


def test_every_generated_file_says_so_at_its_top(generated: dict[str, str]) -> None:
    every(((path, text[:400]) for path, text in generated.items()), _says_so)


def _says_so(top: str) -> None:
    assert "Generated from the declarations" in top or "openpendant's own encoder" in top


@pytest.fixture(name="written")
def _written(once: None, tmp_path: Path) -> Path:
    assert main(["--out", str(tmp_path)]) == 0
    return tmp_path


def test_what_was_written_is_not_stale(written: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--check", "--out", str(written)]) == 0
    assert capsys.readouterr().err == ""


def _change(file: Path) -> None:
    file.write_text(file.read_text() + "\n")


def _remove(file: Path) -> None:
    file.unlink()


def _add(file: Path) -> None:
    file.with_name("another.lua").write_text("")


@pytest.mark.parametrize(
    ("harm", "complaint"),
    [
        (_change, "generated/openpendant.lua is stale"),
        (_remove, "generated/openpendant.lua is missing"),
        (_add, "generated/another.lua is generated no longer"),
    ],
)
def test_a_stale_file_is_named_with_the_way_to_mend_it(
    harm: Callable[[Path], None], complaint: str, written: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    harm(written / "generated" / "openpendant.lua")
    assert main(["--check", "--out", str(written)]) == 1
    assert capsys.readouterr().err.splitlines() == [complaint, "run: make reference"]
    write_files(written)
    assert stale_files(written) == []


@pytest.mark.usefixtures("once")
def test_a_folder_that_cannot_be_written_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["--out", str(tmp_path / "file")]) == 2
    assert "file" in capsys.readouterr().err
