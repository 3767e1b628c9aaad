"""The client over TLS: it encrypts, and trusts nobody whom it was not told to trust."""

from __future__ import annotations

import ssl
from pathlib import Path

import pytest
from rigs.peers.scripted_pendant_server import scripted_server
from rigs.peers.tls_certificates import make_certificate

from openpendant.simplemsg.pendant import Login
from openpendant.tools.pendants.client import PendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio]


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    return make_certificate(tmp_path_factory.mktemp("tls"))


def server_side(certificate: tuple[Path, Path]) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*certificate)
    return context


async def test_a_trusted_server_is_talked_to(certificate: tuple[Path, Path]) -> None:
    trusted = ssl.create_default_context(cafile=str(certificate[0]))
    async with scripted_server(server_side(certificate)) as server:
        async with await PendantClient.connect(
            "127.0.0.1", server.port, tls=trusted, user="ada", password="correct horse"
        ) as pendant:
            await pendant.next_state()
        assert server.one(Login).name == "ada"


async def test_a_server_that_nobody_vouches_for_is_not(certificate: tuple[Path, Path]) -> None:
    async with scripted_server(server_side(certificate)) as server:
        with pytest.raises(ssl.SSLCertVerificationError):
            await PendantClient.connect(
                "127.0.0.1", server.port, tls=ssl.create_default_context(), password="secret"
            )
        assert server.got == []
