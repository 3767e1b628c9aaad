"""The page as the gateway serves it, and what stands in where none was built."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from rigs.processes.web_gateway import GatewayRig, running_gateway

SCRIPT = "console.debug('a page')\n" * 40


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    page = tmp_path / "page"
    (page / "assets").mkdir(parents=True)
    (page / "index.html").write_text("<!doctype html><title>page</title>")
    (page / "assets" / "main-Bx3fGh12.js").write_text(SCRIPT)
    (page / ".hidden.js").write_text("no")
    (page / "notes.py").write_text("no")
    (tmp_path / "secret.txt").write_text("no")
    (page / "way-out.txt").symlink_to(tmp_path / "secret.txt")
    return page


@pytest.fixture
async def rig(folder: Path) -> AsyncIterator[GatewayRig]:
    async with running_gateway(1, page=folder) as running:
        yield running


async def test_the_page_loads_from_here_alone_and_nobody_may_embed_it(rig: GatewayRig) -> None:
    answer = await rig.session.get(rig.page)
    assert answer.status == 200
    assert answer.headers["Content-Type"] == "text/html; charset=utf-8"
    policy = answer.headers["Content-Security-Policy"].split("; ")
    assert {"default-src 'none'", "script-src 'self'", "frame-ancestors 'none'"} <= set(policy)
    assert answer.headers["X-Content-Type-Options"] == "nosniff"


async def test_a_file_named_by_its_hash_is_kept_and_the_page_is_asked_for_again(
    rig: GatewayRig,
) -> None:
    script = await rig.session.get(f"{rig.page}assets/main-Bx3fGh12.js")
    assert await script.text() == SCRIPT
    assert script.headers["Content-Type"] == "text/javascript; charset=utf-8"
    assert "immutable" in script.headers["Cache-Control"]
    page = await rig.session.get(rig.page)
    assert page.headers["Cache-Control"] == "no-cache"
    again = await rig.session.get(rig.page, headers={"If-None-Match": page.headers["ETag"]})
    assert (again.status, await again.read()) == (304, b"")


async def test_a_page_that_is_built_anew_is_served_anew(rig: GatewayRig, folder: Path) -> None:
    before = await rig.session.get(rig.page)
    (folder / "index.html").write_text("<!doctype html><title>a newer page</title>")
    sent = {"If-None-Match": before.headers["ETag"]}
    after = await rig.session.get(rig.page, headers=sent)
    assert "a newer page" in await after.text()


async def test_a_file_crosses_the_network_compressed(rig: GatewayRig) -> None:
    url = f"{rig.page}assets/main-Bx3fGh12.js"
    answer = await rig.session.get(url, headers={"Accept-Encoding": "gzip"})
    assert answer.headers["Content-Encoding"] == "gzip"
    assert int(answer.headers["Content-Length"]) < len(SCRIPT) / 4
    assert await answer.text() == SCRIPT
    plain = await rig.session.get(url, headers={"Accept-Encoding": "identity"})
    assert int(plain.headers["Content-Length"]) == len(SCRIPT)


@pytest.mark.parametrize(
    "name",
    [
        *("missing.js", ".hidden.js", "notes.py", "assets", "way-out.txt", "..%2fsecret.txt"),
        *("assets/..%2f..%2fsecret.txt", "%2fetc%2fhostname.txt", "x%00.js", "assets//main.js"),
    ],
)
async def test_nothing_else_is_served(rig: GatewayRig, name: str) -> None:
    answer = await rig.session.get(f"{rig.page}{name}")
    assert answer.status == 404


async def test_where_no_page_was_built_one_says_how_to_build_it(tmp_path: Path) -> None:
    (tmp_path / "not-built.txt").write_text("npm <said> no & ended")
    async with running_gateway(1, page=tmp_path) as rig:
        answer = await rig.session.get(rig.page)
        text = await answer.text()
        assert answer.status == 503
        assert "<pre>make pendant</pre>" in text
        assert "npm &lt;said> no &amp; ended" in text
        assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
