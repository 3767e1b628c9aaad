import contextlib
import itertools
import sqlite3
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from rigs.data.example_counts import examples
from rigs.data.stored_documents import ANN, BOB, NOON, begin_recording, noon, opened, save

from openpendant.server.store import documents, store_errors
from openpendant.server.store.documents import DocumentKind, Extent
from openpendant.server.store.sqlite_file import MIGRATIONS, OpenFile, open_file
from openpendant.server.store.sqlite_store import SqliteStore

PROGRAM, RECORDING = DocumentKind.PROGRAM, DocumentKind.RECORDING


def test_a_saved_document_is_loaded_as_it_was_saved(store: SqliteStore) -> None:
    body = '{"text": "Größe \\ud83d\\ude00 \U0001f600", "speed": 0.1}'
    heading = store.save(PROGRAM, "weld", body, expected_revision=0, author=ANN)
    assert heading == documents.Heading(PROGRAM, "weld", 1, len(body.encode()), ANN, NOON)
    document = store.load(PROGRAM, "weld")
    assert (document.heading, document.body) == (heading, body)


def test_kinds_have_names_of_their_own(store: SqliteStore) -> None:
    for kind in DocumentKind:
        store.save(kind, "one", f'{{"kind": "{kind}"}}', expected_revision=0, author=ANN)
    assert len(store.headings()) == len(DocumentKind)
    assert [heading.kind for heading in store.headings(DocumentKind.TOOLS)] == [DocumentKind.TOOLS]
    assert store.load(DocumentKind.SCENE, "one").body == '{"kind": "scene"}'


def test_everything_is_there_after_the_file_was_closed_and_opened(path: Path) -> None:
    with opened(path) as store:
        save(store, "weld", '{"speed": 1}')
        begin_recording(store)
        store.append_chunk("r", 0, b"12345678")
    with opened(path) as store:
        assert store.load(PROGRAM, "weld").body == '{"speed": 1}'
        assert store.load_chunks("r", 0, 10) == (b"12345678",)


def test_of_two_edits_of_one_program_the_later_is_refused_with_both_revisions(path: Path) -> None:
    """Promise 22: nobody overwrites what he has not seen, not even from another process."""
    with opened(path) as first, opened(path) as second:
        save(first, "weld", '{"speed": 1}')
        read = second.load(PROGRAM, "weld").heading.revision
        first.save(PROGRAM, "weld", '{"speed": 2}', expected_revision=read, author=ANN)
        with pytest.raises(store_errors.Conflict) as refused:
            second.save(PROGRAM, "weld", '{"speed": 3}', expected_revision=read, author=BOB)
        error = refused.value
        assert (error.expected, error.current) == (1, 2)
        assert (error.saved_by, error.saved_at) == (ANN, NOON)
        assert str(error) == (
            f"program 'weld': the change was made from revision 1,"
            f" but it was saved as revision 2 by 'ann' at {NOON}"
        )
        assert (error.refusal().value, error.refusal().limit) == (2.0, 1.0)
        assert second.load(PROGRAM, "weld").body == '{"speed": 2}'
        second.save(PROGRAM, "weld", '{"speed": 3}', expected_revision=2, author=BOB)
        bodies = [first.load(PROGRAM, "weld", revision).body for revision in (1, 2, 3)]
        assert bodies == ['{"speed": 1}', '{"speed": 2}', '{"speed": 3}']


@pytest.mark.parametrize(("expected", "current"), [(0, 1), (2, 1), (-1, 1), (2**70, 1)])
def test_any_other_revision_is_refused(store: SqliteStore, expected: int, current: int) -> None:
    save(store, "weld")
    with pytest.raises(store_errors.Conflict) as refused:
        save(store, "weld", revision=expected)
    assert (refused.value.expected, refused.value.current) == (expected, current)


def test_a_change_of_a_program_that_never_was_is_refused(store: SqliteStore) -> None:
    with pytest.raises(store_errors.Conflict, match="there is no such document"):
        save(store, "weld", revision=3)
    assert store.headings() == ()


def test_only_the_latest_revisions_are_kept(store: SqliteStore) -> None:
    kept = documents.KEPT_REVISIONS[PROGRAM]
    for revision in range(kept + 5):
        save(store, "weld", f'{{"n": {revision + 1}}}', revision)
    assert [heading.revision for heading in store.history(PROGRAM, "weld")] == [*range(6, kept + 6)]
    assert store.load(PROGRAM, "weld", 6).body == '{"n": 6}'
    with pytest.raises(store_errors.NotFound, match="revision"):
        store.load(PROGRAM, "weld", 5)


def test_the_old_password_of_an_account_is_not_kept(store: SqliteStore) -> None:
    store.save(DocumentKind.ACCOUNT, ANN, '{"hash": "old"}', expected_revision=0, author=ANN)
    store.save(DocumentKind.ACCOUNT, ANN, '{"hash": "new"}', expected_revision=1, author=ANN)
    assert [heading.revision for heading in store.history(DocumentKind.ACCOUNT, ANN)] == [2]


def test_a_deleted_document_is_gone_but_for_its_history(store: SqliteStore) -> None:
    save(store, "weld", '{"speed": 1}')
    deleted = store.delete(PROGRAM, "weld", expected_revision=1, author=BOB)
    assert (deleted.revision, deleted.saved_by, deleted.deleted) == (2, BOB, True)
    assert store.headings() == ()
    with pytest.raises(store_errors.NotFound):
        store.load(PROGRAM, "weld")
    assert store.load(PROGRAM, "weld", 1).body == '{"speed": 1}'
    assert [heading.deleted for heading in store.history(PROGRAM, "weld")] == [False, True]


def test_revisions_go_on_after_a_deletion_so_that_none_fits_twice(store: SqliteStore) -> None:
    save(store, "weld")
    store.delete(PROGRAM, "weld", expected_revision=1, author=BOB)
    for late in (1, 2):
        with pytest.raises(store_errors.Conflict, match="deleted as revision 2 by 'bob'"):
            save(store, "weld", revision=late)
    assert save(store, "weld") == 3


def test_a_deletion_needs_the_kept_revision(store: SqliteStore) -> None:
    with pytest.raises(store_errors.NotFound):
        store.delete(PROGRAM, "weld", expected_revision=0, author=ANN)
    save(store, "weld")
    save(store, "weld", revision=1)
    with pytest.raises(store_errors.Conflict):
        store.delete(PROGRAM, "weld", expected_revision=1, author=ANN)
    assert store.load(PROGRAM, "weld").heading.revision == 2


@pytest.mark.parametrize("revision", [0, -1, 7, 2**63, 2**70])
def test_a_revision_that_is_not_there_is_not_found(store: SqliteStore, revision: int) -> None:
    save(store, "weld")
    with pytest.raises(store_errors.NotFound, match=str(revision)):
        store.load(PROGRAM, "weld", revision)


@pytest.mark.parametrize(
    "name",
    [
        *("", " ", " a", "a ", "x" * 65, "a\0b", "a\nb", "a\x1b[2J", "a\u202eb", "\ud800"),
        *("../a", "a/b", "a\\b", "/", ".", "..", "...", "C:\\x", "e\u0301"),
    ],
    ids=ascii,
)
def test_a_name_not_to_show_or_like_a_path_is_refused(store: SqliteStore, name: str) -> None:
    with pytest.raises(store_errors.BadName, match=r"accepted"):
        save(store, name)
    for question in (store.load, store.history):
        with pytest.raises(store_errors.BadName):
            question(PROGRAM, name)
    with pytest.raises(store_errors.BadName):
        store.delete(PROGRAM, name, expected_revision=1, author=ANN)
    with pytest.raises(store_errors.BadName):
        store.append_chunk(name, 0, b"x")
    assert store.headings() == ()


@pytest.mark.parametrize(
    "name", ["a", "x" * 64, "Größe 1", "机器人", "a'; DROP TABLE revision; --"]
)
def test_any_other_name_is_taken(store: SqliteStore, name: str) -> None:
    save(store, name)
    assert store.load(PROGRAM, name).heading.name == name


def test_a_new_name_fits_the_fields_of_our_messages(store: SqliteStore) -> None:
    save(store, "ü" * 32)
    with pytest.raises(
        store_errors.BadName, match="has 66 bytes of UTF-8; accepted: up to 64"
    ) as refused:
        save(store, "ü" * 33)
    refusal = refused.value.refusal()
    assert (refusal.value, refusal.limit) == (66, 64)


def test_whoever_saves_has_a_name_that_can_be_shown(store: SqliteStore) -> None:
    with pytest.raises(store_errors.BadName):
        store.save(PROGRAM, "weld", "{}", expected_revision=0, author="a\nb")
    store.save(PROGRAM, "weld", "{}", expected_revision=0, author="127.0.0.1/ann")


@pytest.mark.parametrize(
    "body",
    ["", "{", '{"a": 1', "{'a': 1}", "NaN", '{"a": NaN}', "[" * 10**6 + "]" * 10**6],
    ids=lambda body: body[:8],
)
def test_a_body_that_is_not_json_is_refused(store: SqliteStore, body: str) -> None:
    with pytest.raises(store_errors.BadDocument, match="not JSON"):
        save(store, "weld", body)


def test_half_a_surrogate_pair_is_no_text(store: SqliteStore) -> None:
    with pytest.raises(store_errors.BadDocument, match=r"U\+D800.*no text|character 3"):
        save(store, "weld", '{"\ud800": 1}')


@pytest.mark.parametrize("kind", DocumentKind)
def test_a_body_may_be_as_large_as_its_cap(store: SqliteStore, kind: DocumentKind) -> None:
    limit = documents.MOST_BODY_BYTES[kind]
    body = '{"a": "' + "x" * (limit - 9) + '"}'
    assert store.save(kind, "a", body, expected_revision=0, author=ANN).size == limit
    for larger in (body + " ", body[:-2] + 'é"}'):
        with pytest.raises(store_errors.TooLarge) as refused:
            store.save(kind, "a", larger, expected_revision=1, author=ANN)
        assert (refused.value.limit, refused.value.refusal().limit) == (limit, limit)
        assert refused.value.size > limit


def test_a_recording_grows_by_chunks_without_a_cap(store: SqliteStore) -> None:
    begin_recording(store)
    assert store.extent("r") == Extent(0, 0)
    for n in range(100):
        assert store.append_chunk("r", n, b"%08d" % n) == Extent(n + 1, 8 * (n + 1))
    assert store.extent("r") == Extent(100, 800)
    assert store.load_chunks("r", 98, 10) == (b"00000098", b"00000099")
    assert store.load_chunks("r", 0, 2) == (b"00000000", b"00000001")
    assert store.load_chunks("r", 2**70, 2**70) == ()


def test_a_chunk_whose_acknowledgement_was_lost_may_be_repeated(store: SqliteStore) -> None:
    begin_recording(store)
    store.append_chunk("r", 0, b"a")
    assert store.append_chunk("r", 0, b"a") == Extent(1, 1)


@pytest.mark.parametrize(("sequence", "data"), [(0, b"a"), (1, b"c"), (3, b"c"), (-1, b"c")])
def test_a_chunk_out_of_order_is_refused(store: SqliteStore, sequence: int, data: bytes) -> None:
    begin_recording(store)
    store.append_chunk("r", 0, b"a")
    store.append_chunk("r", 1, b"b")
    with pytest.raises(store_errors.OutOfSequence) as refused:
        store.append_chunk("r", sequence, data)
    assert (refused.value.sequence, refused.value.following) == (sequence, 2)
    assert store.load_chunks("r", 0, 9) == (b"a", b"b")


def test_a_chunk_is_neither_empty_nor_larger_than_its_cap(store: SqliteStore) -> None:
    begin_recording(store)
    with pytest.raises(store_errors.BadDocument, match="empty"):
        store.append_chunk("r", 0, b"")
    with pytest.raises(store_errors.TooLarge):
        store.append_chunk("r", 0, bytes(documents.MOST_CHUNK_BYTES + 1))
    store.append_chunk("r", 0, bytes(documents.MOST_CHUNK_BYTES))


def test_chunks_need_a_recording(store: SqliteStore) -> None:
    save(store, "r")
    with pytest.raises(store_errors.NotFound, match="recording 'r'"):
        store.append_chunk("r", 0, b"a")
    with pytest.raises(store_errors.NotFound, match="recording 'r'"):
        store.extent("r")


def test_a_deleted_recording_takes_its_chunks_with_it(store: SqliteStore) -> None:
    begin_recording(store)
    store.append_chunk("r", 0, b"a")
    store.delete(RECORDING, "r", expected_revision=1, author=ANN)
    with pytest.raises(store_errors.NotFound):
        store.load_chunks("r", 0, 1)
    begin_recording(store)
    assert store.extent("r") == Extent(0, 0)


def test_what_is_done_together_is_kept_together_or_not_at_all(store: SqliteStore) -> None:
    def save_both(revision: int) -> None:
        with store.together():
            save(store, "one")
            save(store, "two", revision=revision)

    with pytest.raises(store_errors.Conflict):
        save_both(9)
    assert store.headings() == ()
    save_both(0)
    assert len(store.headings()) == 2


def test_a_clock_that_jumps_changes_stamps_and_nothing_else(path: Path) -> None:
    """Promise 24."""
    jumps = itertools.cycle(["2025-11-22T12:00:00", "1970-01-01T00:00:00", "2025-11-20T12:00:00"])
    steady, jumping = path.with_name("steady.db"), path.with_name("jumping.db")
    histories = []
    for file, clock in ((steady, noon), (jumping, lambda: next(jumps))):
        with opened(file, clock) as store:
            for revision in range(9):
                save(store, "weld", f'{{"n": {revision}}}', revision)
            assert store.load(PROGRAM, "weld").body == '{"n": 8}'
            history = store.history(PROGRAM, "weld")
            histories.append([(heading.revision, heading.size) for heading in history])
    assert histories[0] == histories[1]


def test_while_another_process_writes_a_save_waits_then_is_refused(path: Path) -> None:
    opened_file = open_file(path, MIGRATIONS)
    opened_file.connection.execute("PRAGMA busy_timeout = 10")
    with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as other:
        store = SqliteStore(path, OpenFile(opened_file.connection), noon)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(store_errors.StoreBusy, match="locked"):
            save(store, "weld")
        other.execute("ROLLBACK")
        assert save(store, "weld") == 1
        store.close()


def test_an_acknowledgement_means_full_sync(store: SqliteStore) -> None:
    """Promise 22: the log is synchronised at each commit, not at checkpoints only."""
    assert store.connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    assert store.connection.execute("PRAGMA synchronous").fetchone() == (2,)


def test_a_store_in_memory_takes_no_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    store = SqliteStore(Path(":memory:"), OpenFile(_memory()), noon)
    save(store, "a")
    store.delete(PROGRAM, "a", expected_revision=1, author=ANN)
    store.close()
    assert list(tmp_path.iterdir()) == []


class Revisions(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        # No disk: 5,000 examples in the soak run.
        self.store = SqliteStore(Path(":memory:"), OpenFile(_memory()), noon)
        self.bodies: dict[str, str] = {}
        self.revisions: dict[str, int] = {}

    def teardown(self) -> None:
        self.store.close()

    names = st.sampled_from(["a", "b"])

    @rule(name=names, expected=st.integers(0, 6), value=st.integers(0, 9))
    def save(self, name: str, expected: int, value: int) -> None:
        body = f'{{"v": {value}}}'
        kept = self.revisions.get(name, 0) if name in self.bodies else 0
        if expected != kept:
            with pytest.raises(store_errors.Conflict) as refused:
                save(self.store, name, body, expected)
            assert refused.value.current == self.revisions.get(name, 0)
            return
        save(self.store, name, body, expected)
        self.revisions[name] = self.revisions.get(name, 0) + 1
        self.bodies[name] = body

    @precondition(lambda self: self.bodies)
    @rule(name=names)
    def delete(self, name: str) -> None:
        if name not in self.bodies:
            return
        self.store.delete(PROGRAM, name, expected_revision=self.revisions[name], author=ANN)
        self.revisions[name] += 1
        del self.bodies[name]

    @invariant()
    def the_store_holds_what_the_dictionary_holds(self) -> None:
        headings = {heading.name: heading.revision for heading in self.store.headings()}
        assert headings == {name: self.revisions[name] for name in self.bodies}
        loaded = {name: self.store.load(PROGRAM, name).body for name in headings}
        assert loaded == self.bodies


def _memory() -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:", isolation_level=None)
    for migration in MIGRATIONS:
        for statement in migration.statements:
            connection.execute(statement)
    return connection


TestRevisions = Revisions.TestCase
TestRevisions.settings = settings(max_examples=examples(8, in_soak=5_000))
