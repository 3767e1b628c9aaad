"""What is said at the start of a certificate whose TLS handshake costs too much."""

import itertools
import ssl
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from promises.promise_table import figure
from rigs.peers.tls_certificates import P_256, make_certificate

from openpendant.server.access import handshake_cost
from openpendant.server.access.handshake_cost import cost_warnings, dearest_step
from openpendant.server.access.open_access import opened_access, server_context
from openpendant.server.settings.cell_settings import TlsSettings, make_settings
from openpendant.server.settings.server_settings import ServerSettings


@pytest.fixture(scope="module")
def large_pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A certificate and its key, of three primes: smaller ones are found in half the time."""
    key = ("rsa:4096", "-pkeyopt", "rsa_keygen_primes:3")
    return make_certificate(tmp_path_factory.mktemp("large"), key=key)


def context_with(folder: Path) -> tuple[ssl.SSLContext, str]:
    return context_of(make_certificate(folder, key=P_256), ca=False)


def context_of(pair: tuple[Path, Path], *, ca: bool) -> tuple[ssl.SSLContext, str]:
    certificate, secret = map(str, pair)
    context = server_context(
        TlsSettings(certificate=certificate, key=secret, ca=certificate if ca else "")
    )
    assert context is not None
    return context, certificate


def clock(*costs: int) -> Callable[[], int]:
    """Return a clock by which the steps cost so much in turn [ns]."""

    def times() -> Iterator[int]:
        now = 0
        for cost in itertools.cycle(costs):
            yield now
            now += cost
            yield now

    return times().__next__


@pytest.mark.parametrize(
    ("cost", "said"), [(figure(53, "turn").ns, False), (figure(53, "turn").ns + 1, True)]
)
def test_promise_53_a_dear_certificate_is_named_with_what_to_use_instead(
    tmp_path: Path, cost: int, said: bool
) -> None:
    context, certificate = context_with(tmp_path)
    warnings = cost_warnings(context, certificate, clock(1, cost, 1, 1))
    assert len(warnings) == said
    assert all(certificate in each and "prime256v1" in each for each in warnings)


def test_the_cheapest_of_five_handshakes_counts(tmp_path: Path) -> None:
    context, certificate = context_with(tmp_path)
    dear = [9_000_000] * 4
    assert not cost_warnings(context, certificate, clock(*dear * 3, 1, 1, 1, 1, *dear))
    assert cost_warnings(context, certificate, clock(*dear))


@pytest.mark.parametrize("ca", ["", "asks for certificates"])
def test_the_step_that_signs_is_among_those_that_are_measured(
    tmp_path: Path, large_pair: tuple[Path, Path], ca: str
) -> None:
    small, _ = context_of(make_certificate(tmp_path, key=P_256), ca=bool(ca))
    large, _ = context_of(large_pair, ca=bool(ca))
    cost = [min(dearest_step(context) for _ in range(5)) for context in (small, large)]
    assert cost[1] > 3 * cost[0]


def test_a_server_says_so_when_it_opens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(handshake_cost, "MOST_NS", 0)
    certificate, key = map(str, make_certificate(tmp_path))
    tls = {"certificate": certificate, "key": key}
    settings = make_settings({"store": {"path": "off"}, "tls": tls}, "test")
    with opened_access(ServerSettings((settings,)), "test") as access:
        assert any(certificate in each for each in access.warnings)
