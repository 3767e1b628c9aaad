import io
import json
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from rigs.cells.expectations import known
from rigs.data.stored_documents import opened

from openpendant.server.access import passwords
from openpendant.server.access.access_backend import read_at_start, unreadable_accounts
from openpendant.server.access.accounts import Account, AccountBook, AccountRefused, StoredAccounts
from openpendant.server.access.admission import Admission
from openpendant.server.cli import users_commands
from openpendant.server.journal.event_records import PasswordNumbers, book_from_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant.roles import Role

Capture = pytest.CaptureFixture[str]

CANARY = "canary-7f3a horse"
CHEAP = passwords.ScryptCost(n=2**14, r=8, p=1)

Users = Callable[..., int]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "store.db"


@cache
def hashed(password: str) -> passwords.PasswordHash:
    return passwords.hash_password(
        passwords.Secret(password), os.urandom(passwords.SALT_BYTES), CHEAP
    )


@pytest.fixture
def users(file: Path, monkeypatch: pytest.MonkeyPatch) -> Users:
    monkeypatch.setattr(
        users_commands, "hash_password", lambda password, salt: hashed(password.reveal())
    )

    def run(*arguments: str, password: str = CANARY) -> int:
        monkeypatch.setattr("sys.stdin", io.StringIO(password + "\n"))
        return users_commands.main([*arguments, "--store", str(file)])

    return run


def add(users: Users, name: str, role: str = "admin", password: str = CANARY) -> int:
    return users("add", name, "--role", role, "--password-stdin", password=password)


def book(file: Path) -> AccountBook:
    with opened(file) as store:
        return StoredAccounts(store, "test").book()


def keep(file: Path, name: str, body: str) -> None:
    with opened(file) as store:
        store.save(DocumentKind.ACCOUNT, name, body, expected_revision=0, author="test")


def account_of(file: Path, name: str) -> Account:
    return known(book(file).find(name))


def test_an_account_that_was_added_is_kept_and_listed(
    users: Users, file: Path, capsys: Capture
) -> None:
    assert add(users, "Ann") == 0
    assert add(users, "otto", "operator") == 0
    assert users("list", "--json") == 0
    listed = json.loads(capsys.readouterr().out)
    assert listed == [
        {"name": "Ann", "role": "admin", "disabled": False},
        {"name": "otto", "role": "operator", "disabled": False},
    ]
    assert passwords.is_password(passwords.Secret(CANARY), account_of(file, "ann").password)


def test_the_first_account_says_what_becomes_of_the_ports_that_know_no_login(
    users: Users, capsys: Capture
) -> None:
    add(users, "ann")
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "closes its ROS-Industrial ports" in shown.err
    assert "know no login" in shown.err
    add(users, "otto", "operator")
    assert capsys.readouterr() == ("", "")


def test_no_password_is_in_any_output_or_in_the_store(
    users: Users, file: Path, capsys: Capture
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
    users: Users, capsys: Capture, arguments: tuple[str, ...], code: int, reason: str
) -> None:
    add(users, "ann")
    add(users, "otto", "operator")
    capsys.readouterr()
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
    otto = account_of(file, "otto")
    assert (otto.role, otto.disabled) == (Role.PROGRAMMER, True)
    assert users("enable", "otto") == 0
    assert users("set-password", "otto", "--password-stdin", password="another horse") == 0
    otto = account_of(file, "otto")
    assert passwords.is_password(passwords.Secret("another horse"), otto.password)
    assert users("remove", "otto") == 0
    assert users("remove", "ann") == 0
    assert len(book(file)) == 0
    assert add(users, "ann") == 0


def test_without_a_terminal_a_password_is_asked_for_by_option(
    users: Users, capsys: Capture
) -> None:
    assert users("add", "ann", "--role", "admin") == 2
    assert "--password-stdin" in capsys.readouterr().err


def test_a_list_of_no_store_makes_none(users: Users, file: Path) -> None:
    assert users("list") == 0
    assert not file.exists()


def test_a_document_that_is_no_account_is_named_without_its_hash(file: Path) -> None:
    keep(file, "ann", '{"name":"canary"}')
    unreadable = book(file).unreadable
    assert list(unreadable) == ["ann"]
    assert "canary" not in str(unreadable)


@pytest.fixture
def eve(file: Path) -> None:
    keep(file, "eve", '{"role":"admin"}')


@pytest.mark.usefixtures("eve")
def test_an_account_that_cannot_be_read_is_shown_and_blocks_no_other(
    users: Users, file: Path, capsys: Capture
) -> None:
    assert add(users, "otto", "operator") == 3
    assert add(users, "ann") == 0
    assert users("list") == 0
    assert "eve" + 31 * " " + "unreadable: name: Field required" in capsys.readouterr().out
    assert users("list", "--json") == 0
    assert json.loads(capsys.readouterr().out)[1] == {
        "name": "eve",
        "unreadable": "name: Field required",
    }
    assert users("remove", "ann") == 3
    assert "the only admin" in capsys.readouterr().err


@pytest.mark.usefixtures("eve")
@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("add", "eve", "--role", "admin", "--password-stdin"), "remove it first"),
        (("set-role", "eve", "viewer"), "cannot be read"),
        (("set-password", "eve", "--password-stdin"), "remove it and add it anew"),
    ],
)
def test_an_account_that_cannot_be_read_is_not_changed_unseen(
    users: Users, capsys: Capture, arguments: tuple[str, ...], says: str
) -> None:
    assert users(*arguments) == 3
    assert says in capsys.readouterr().err


@pytest.mark.usefixtures("eve")
def test_an_account_that_cannot_be_read_is_removed_unread(users: Users, file: Path) -> None:
    assert users("remove", "eve") == 0
    assert book(file).is_empty
    assert add(users, "eve") == 0


@pytest.mark.usefixtures("eve")
def test_while_an_account_cannot_be_read_nobody_is_single_user(file: Path) -> None:
    accounts, _ = read_at_start(file)
    assert (len(accounts), accounts.is_empty) == (0, False)
    (told,) = unreadable_accounts(accounts)
    assert "account 'eve' cannot be read" in told
    assert told.endswith("openpendant users remove eve")
    kept, _ = book_from_json(PasswordNumbers().book_to_json(accounts, single_user=True))
    assert not kept.is_empty, "a rerun of the journal lets nobody in either"
    login = Admission(accounts, single_user_host=True, record=lambda entry: None)
    assert login.welcomed(1, "127.0.0.1", "eve", "cell", 0) is None


def test_a_refusal_carries_its_code(file: Path) -> None:
    with opened(file) as store, pytest.raises(AccountRefused) as caught:
        StoredAccounts(store, "test").remove("ann")
    assert caught.value.refusal.code.name == "UNKNOWN_ACCOUNT"
