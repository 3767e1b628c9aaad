"""The files of the page, as the gateway serves them.

Owns their types, how long a browser keeps them, what the page may load and be embedded in, and the
page that stands in where none was built.
"""

from __future__ import annotations

import asyncio
import gzip
import hashlib
import re
from dataclasses import dataclass
from pathlib import Path

from aiohttp import web

BUILT = Path(__file__).parent / "page"
"""Where `build` puts the page."""

_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".ico": "image/x-icon",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
    ".webmanifest": "application/manifest+json",
}
"""Types of all that a page may consist of; nothing else is served."""

_COMPRESSIBLE = {".css", ".html", ".js", ".json", ".svg", ".txt"}

_HAS_HASH = re.compile(r"[-.][A-Za-z0-9_-]{8,}\.[a-z]+$")
"""Names that the build gives: another content has another name."""

_MOST_FILE = 16 * 2**20

HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'"
    " 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self'; connect-src 'self';"
    " manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}
"""With every file: the page loads from here alone, and no other page may embed it.

Whoever could embed it could have somebody hold a button that he does not see.
"""

NOT_BUILT = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>openpendant: the page is not built</title>
<link rel="icon" href="data:,">
<style>
  body {{ font: 16px/1.5 system-ui; max-width: 40rem; margin: 3rem auto; padding: 0 1rem;
    color: #17202a; background: #eaeef2 }}
  pre {{ background: #fff; padding: 1rem; overflow: auto }}
  @media (prefers-color-scheme: dark) {{
    body {{ color: #e9edf1; background: #13171b }} pre {{ background: #1a2026 }}
  }}
</style>
<h1>The browser pendant is not built yet</h1>
<p>The gateway runs, but the page that it serves has to be built once. In a checkout:</p>
<pre>make pendant</pre>
<p>It uses Node.js 20.19, 22.12 or newer with npm where this machine has them, else it fetches
them into its own environment (61 MB). Then load this page again.</p>
<p>{reason}</p>
<p>Until then there is the pendant in a terminal:</p>
<pre>openpendant pendant</pre>
</html>
"""
"""What is served in place of a page; `reason` is why there is none, if that is known."""

REASON_FILE = "not-built.txt"
"""In the folder of the page: why the last build failed, in a sentence."""


@dataclass(frozen=True, slots=True)
class PageFile:
    """A file as it is served.

    Attributes:
        etag: of the content.
        compressed: None where that saves nothing.
    """

    content: bytes
    media_type: str
    etag: str
    compressed: bytes | None
    is_kept: bool


class PageFiles:
    """The files of a folder; one that changed is read anew, so a page may be built meanwhile."""

    def __init__(self, folder: Path = BUILT) -> None:
        """Serve a folder, which need not exist yet."""
        self._folder = folder
        self._known: dict[Path, tuple[tuple[int, int], PageFile]] = {}

    async def serve(self, request: web.Request) -> web.Response:
        """Answer a request for the page or one of its files."""
        name = request.match_info.get("file") or "index.html"
        file = await asyncio.to_thread(self._read, name)
        if file is None and name == "index.html":
            return self._stand_in()
        if file is None:
            raise web.HTTPNotFound(text="no such file\n", headers=HEADERS)
        kept = "public, max-age=31536000, immutable" if file.is_kept else "no-cache"
        headers = {**HEADERS, "ETag": f'"{file.etag}"', "Cache-Control": kept}
        headers["Vary"] = "Accept-Encoding"
        if f'"{file.etag}"' in request.headers.get("If-None-Match", ""):
            return web.Response(status=304, headers=headers)
        body = file.content
        if file.compressed is not None and "gzip" in request.headers.get("Accept-Encoding", ""):
            body, headers["Content-Encoding"] = file.compressed, "gzip"
        return web.Response(body=body, headers={**headers, "Content-Type": file.media_type})

    def _stand_in(self) -> web.Response:
        try:
            reason = (self._folder / REASON_FILE).read_text("utf-8")[:1_000]
        except OSError:
            reason = ""
        shown = reason.replace("&", "&amp;").replace("<", "&lt;")
        return web.Response(
            text=NOT_BUILT.format(reason=shown),
            content_type="text/html",
            charset="utf-8",
            status=503,
            headers={**HEADERS, "Cache-Control": "no-store"},
        )

    def _read(self, name: str) -> PageFile | None:
        """Return a file of the folder and of a known type; None where there is none."""
        parts = name.split("/")
        path = self._folder.joinpath(*parts)
        if path.suffix not in _TYPES or any(not part or part.startswith(".") for part in parts):
            return None
        try:
            # A link may lead out of the folder.
            if not path.resolve().is_relative_to(self._folder.resolve()) or not path.is_file():
                return None
            stat = path.stat()
            state = (stat.st_mtime_ns, stat.st_size)
            known = self._known.get(path)
            if known is None or known[0] != state:
                known = self._known[path] = (state, _loaded(path))
        except (OSError, ValueError):
            return None
        return known[1]


def _loaded(path: Path) -> PageFile:
    with path.open("rb") as stream:
        content = stream.read(_MOST_FILE)
    compressed = gzip.compress(content, mtime=0) if path.suffix in _COMPRESSIBLE else None
    if compressed is not None and len(compressed) >= len(content):
        compressed = None
    etag = hashlib.sha256(content).hexdigest()[:32]
    is_kept = _HAS_HASH.search(path.name) is not None
    return PageFile(content, _TYPES[path.suffix], etag, compressed, is_kept)
