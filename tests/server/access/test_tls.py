import shutil
import ssl
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from pydantic import ValidationError
from rigs.cells.expectations import known
from rigs.peers.tls_certificates import make_certificate

from openpendant.server.access.open_access import TlsUnusable, server_context
from openpendant.server.settings.cell_settings import TlsSettings


class Pair(NamedTuple):
    certificate: Path
    key: Path

    def settings(self, ca: Path | None = None) -> TlsSettings:
        return TlsSettings(
            certificate=str(self.certificate), key=str(self.key), ca="" if ca is None else str(ca)
        )


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Pair, Pair]:
    folder = tmp_path_factory.mktemp("tls")
    return Pair(*make_certificate(folder)), Pair(*make_certificate(folder, "client"))


class End:
    def __init__(self, context: ssl.SSLContext, *, is_server: bool) -> None:
        self.incoming, self.outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        name = None if is_server else "127.0.0.1"
        self.tls = context.wrap_bio(self.incoming, self.outgoing, is_server, server_hostname=name)

    def shake(self) -> bool:
        try:
            self.tls.do_handshake()
        except ssl.SSLWantReadError:
            return False
        return True

    def encrypted(self, data: bytes) -> bytes:
        self.tls.write(data)
        return self.outgoing.read()

    def take(self, record: bytes) -> bytes:
        self.incoming.write(record)
        return self.tls.read()


def connect(server: ssl.SSLContext, client: ssl.SSLContext) -> tuple[End, End]:
    ends = End(server, is_server=True), End(client, is_server=False)
    done = [False, False]
    for _ in range(6):
        for index in (1, 0):
            done[index] = done[index] or ends[index].shake()
            ends[1 - index].incoming.write(ends[index].outgoing.read())
    assert all(done)
    return ends


def client_context(trusted: Pair, own: Pair | None = None) -> ssl.SSLContext:
    context = ssl.create_default_context(cafile=str(trusted.certificate))
    if own is not None:
        context.load_cert_chain(own.certificate, own.key)
    return context


def context_of(settings: TlsSettings) -> ssl.SSLContext:
    return known(server_context(settings))


def test_without_a_certificate_there_is_no_tls() -> None:
    assert server_context(TlsSettings()) is None


@pytest.mark.parametrize("given", [{"certificate": "a"}, {"key": "a"}, {"ca": "a"}])
def test_half_of_the_settings_are_refused(given: dict[str, str]) -> None:
    with pytest.raises(ValidationError):
        TlsSettings.model_validate(given)


def test_a_client_is_served_by_tls_1_3(pairs: tuple[Pair, Pair]) -> None:
    own, _ = pairs
    server, client = connect(context_of(own.settings()), client_context(own))
    assert client.tls.version() == "TLSv1.3"
    assert server.take(client.encrypted(b"hello")) == b"hello"


def test_an_older_version_is_refused(pairs: tuple[Pair, Pair]) -> None:
    own, _ = pairs
    old = client_context(own)
    old.maximum_version = ssl.TLSVersion.TLSv1_2
    with pytest.raises(ssl.SSLError):
        connect(context_of(own.settings()), old)


def test_with_a_ca_only_clients_with_its_certificate_are_served(pairs: tuple[Pair, Pair]) -> None:
    own, other = pairs
    context = context_of(own.settings(ca=other.certificate))
    server, client = connect(context, client_context(own, other))
    assert server.take(client.encrypted(b"hello")) == b"hello"
    with pytest.raises(ssl.SSLError):
        connect(context, client_context(own))


@pytest.mark.parametrize(
    "attack",
    [
        lambda first, second, other: [first, first],
        lambda first, second, other: [second, first],
        lambda first, second, other: [first, other],
        lambda first, second, other: [first, second[:-1] + bytes([second[-1] ^ 1])],
    ],
    ids=["replayed", "reordered", "from another connection", "bit flipped"],
)
def test_no_record_is_taken_twice_out_of_order_altered_or_from_elsewhere(
    pairs: tuple[Pair, Pair], attack: Callable[[bytes, bytes, bytes], list[bytes]]
) -> None:
    """Promise 28: no such command reaches the server, and the connection ends."""
    own, _ = pairs
    context = context_of(own.settings())
    server, client = connect(context, client_context(own))
    _, elsewhere = connect(context, client_context(own))
    first, second = client.encrypted(b"press 1"), client.encrypted(b"press 2")
    taken: list[bytes] = []
    with pytest.raises(ssl.SSLError):
        taken.extend(map(server.take, attack(first, second, elsewhere.encrypted(b"press 3"))))
    assert taken in ([], [b"press 1"])


def test_every_file_that_cannot_be_used_is_named(pairs: tuple[Pair, Pair], tmp_path: Path) -> None:
    own, other = pairs
    empty, open_key, damaged = tmp_path / "empty", tmp_path / "open", tmp_path / "damaged"
    empty.write_bytes(b"")
    empty.chmod(0o600)
    shutil.copy(own.key, open_key)
    open_key.chmod(0o644)
    damaged.write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    locked = Pair(*make_certificate(tmp_path, "locked", "-passout", "pass:secret"))
    cases = [
        (Pair(tmp_path / "nowhere", own.key), None, "nowhere", "cannot be read: No such file"),
        (Pair(own.certificate, tmp_path), None, tmp_path.name, "cannot be read: Is a directory"),
        (Pair(empty, own.key), None, "empty", "holds no certificate in PEM form"),
        (Pair(own.certificate, empty), None, "empty", "holds no private key in PEM form"),
        (Pair(damaged, own.key), None, "damaged", "is damaged"),
        (Pair(own.certificate, other.key), None, "client.key", "does not belong"),
        (Pair(own.certificate, locked.key), None, "locked.key", "is encrypted"),
        (Pair(own.certificate, open_key), None, "open", "mode 644"),
        (own, damaged, "damaged", "is damaged"),
        (own, empty, "empty", "holds no certificate"),
    ]
    keys = "".join(each.key.read_text() for each in (own, other, locked))
    for pair, ca, file, problem in cases:
        with pytest.raises(TlsUnusable) as caught:
            server_context(pair.settings(ca))
        assert Path(caught.value.file).name == file
        assert problem in caught.value.problem
        # Promise 30: what a key file holds is never repeated.
        assert not any(line in str(caught.value) for line in keys.splitlines())
