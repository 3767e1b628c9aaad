"""`openpendant users`: accounts in a real store, by arguments and standard input."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from openpendant.server.access import cli
from openpendant.server.access.account_store import AccountRefused, StoredAccounts
from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.passwords import ScryptCost, hash_password, is_password
from openpendant.server.access.roles import Role
from openpendant.server.access.secret import Secret
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.errors import BadDocument
from openpendant.server.store.sqlite_store import open_store

CANARY = "canary-7f3a horse"
CHEAP = ScryptCost(n=2**14, r=8, p=1)

Users = Callable[..., int]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "store.db"


@pytest.fixture
def users(file: Path, monkeypatch: pytest.MonkeyPatch) -> Users:
    monkeypatch.setattr(
        cli, "hash_password", lambda password, salt: hash_password(password, salt, CHEAP)
    )

    def run(*arguments: str, password: str = CANARY) -> int:
        monkeypatch.setattr("sys.stdin", io.StringIO(password + "\n"))
        return cli.main([*arguments, "--store", str(file)])

    return run


def add(users: Users, name: str, role: str = "admin", password: str = CANARY) -> int:
    return users("add", name, "--role", role, "--password-stdin", password=password)


def book(file: Path) -> AccountBook:
    store = open_store(file)
    try:
        return StoredAccounts(store, "test").book()
    finally:
        store.close()


def test_an_account_that_was_added_is_kept_and_listed(
    users: Users, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert add(users, "Ann") == 0
    assert add(users, "otto", "operator") == 0
    assert users("list", "--json") == 0
    listed = json.loads(capsys.readouterr().out)
    assert listed == [
        {"name": "Ann", "role": "admin", "disabled": False},
        {"name": "otto", "role": "operator", "disabled": False},
    ]
    ann = book(file).find("ann")
    assert ann is not None
    assert is_password(Secret(CANARY), ann.password)


def test_no_password_is_in_any_output_or_in_the_store(
    users: Users, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Promise 30: canaries as passwords, taken and refused."""
    add(users, "ann")
    add(users, "ann")
    add(users, "bob", password="canary")
    add(users, "canary-7f3a", "viewer")
    users("set-password", "ann", "--password-stdin")
    users("list")
    shown = capsys.readouterr()
    assert CANARY not in shown.out + shown.err
    assert all(CANARY.encode() not in path.read_bytes() for path in file.parent.iterdir())


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (("add", "ANN", "--role", "viewer", "--password-stdin"), 3, "an account 'ANN' already"),
        (("add", "a/b", "--role", "viewer", "--password-stdin"), 2, "a name is letters"),
        (("add", "bob", "--role", "king", "--password-stdin"), 2, "king"),
        (("remove", "bob"), 3, "no account 'bob'; there are: ann, otto"),
        (("remove", "ann"), 3, "the only admin"),
        (("set-role", "ann", "viewer"), 3, "the only admin"),
        (("disable", "ann"), 3, "the only admin"),
        (("remove", "b\x1b[2Jb"), 3, "no account"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(
    users: Users,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    code: int,
    reason: str,
) -> None:
    add(users, "ann")
    add(users, "otto", "operator")
    assert users(*arguments) == code
    err = capsys.readouterr().err
    assert reason in err
    assert err.rstrip("\n").isprintable()


def test_the_first_account_has_to_be_admin(users: Users, file: Path) -> None:
    assert add(users, "otto", "operator") == 3
    assert len(book(file)) == 0


def test_roles_passwords_and_accounts_can_be_changed(users: Users, file: Path) -> None:
    add(users, "ann")
    add(users, "otto", "operator")
    assert users("set-role", "otto", "programmer") == 0
    assert users("disable", "otto") == 0
    otto = book(file).find("otto")
    assert otto is not None
    assert (otto.role, otto.disabled) == (Role.PROGRAMMER, True)
    assert users("enable", "otto") == 0
    assert users("set-password", "otto", "--password-stdin", password="another horse") == 0
    otto = book(file).find("otto")
    assert otto is not None
    assert is_password(Secret("another horse"), otto.password)
    assert users("remove", "otto") == 0
    assert users("remove", "ann") == 0
    assert len(book(file)) == 0
    assert add(users, "ann") == 0


def test_without_a_terminal_a_password_is_asked_for_by_option(
    users: Users, capsys: pytest.CaptureFixture[str]
) -> None:
    assert users("add", "ann", "--role", "admin") == 2
    assert "--password-stdin" in capsys.readouterr().err


def test_a_list_of_no_store_makes_none(users: Users, file: Path) -> None:
    assert users("list") == 0
    assert not file.exists()


def test_a_document_that_is_no_account_is_named_without_its_hash(file: Path) -> None:
    store = open_store(file)
    store.save(DocumentKind.ACCOUNT, "ann", '{"name":"canary"}', expected_revision=0, author="test")
    with pytest.raises(BadDocument, match="ann") as caught:
        StoredAccounts(store, "test").book()
    assert "canary" not in str(caught.value)
    store.close()


def test_a_refusal_carries_its_code(file: Path) -> None:
    store = open_store(file)
    with pytest.raises(AccountRefused) as caught:
        StoredAccounts(store, "test").remove("ann")
    assert caught.value.refusal.code.name == "UNKNOWN_ACCOUNT"
    store.close()
