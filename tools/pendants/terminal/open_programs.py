"""Program requests of the terminal pendant: list, open, edit and dry-run stored programs.

Owns the requests and that the open program is reloaded when it may have changed. All functions
raise the errors of the client library; `performer` reports a refusal.
"""

from __future__ import annotations

import json

from openpendant.simplemsg.verdicts import VerdictCode

from ..client import PendantClient, Refused
from .panel import Panel
from .reachability import DryRunFindings
from .taught_program import ProgramEdit, TaughtProgram


class OpenPrograms:
    """The stored programs and the open program on one connection."""

    def __init__(self, client: PendantClient, panel: Panel) -> None:
        """Make one for an open connection.

        Args:
            client: the connection.
            panel: receives what was loaded.
        """
        self._client = client
        self._panel = panel

    async def names(self) -> list[str]:
        """Return the names of all programs."""
        names: list[str] = []
        first: int | None = 0
        while first is not None:
            answer = await self._client.programs.list(first=first)
            names += [each["name"] for each in answer["programs"]]
            first = answer["next"]
        return names

    async def create(self, name: str) -> None:
        """Create an empty program and show it."""
        await self._client.programs.create(name)
        self._panel.messages.add(f"{name} is new and empty")
        self._panel.opened(await self._load(name))

    async def open(self, name: str) -> None:
        """Show a program, or ask to create it if none has that name."""
        try:
            self._panel.opened(await self._load(name))
        except Refused as refused:
            if refused.code not in (VerdictCode.NOT_FOUND, VerdictCode.PROGRAM_UNKNOWN):
                raise
            self._panel.not_there(name)

    async def load_anew(self, name: str) -> None:
        """Reload the open program, which another client has changed, and say what is shown now."""
        shown = self._panel.teaching.program
        if shown is None or shown.name != name:
            return
        try:
            program = await self._load(name)
        except Refused as refused:
            if refused.code == VerdictCode.NOT_FOUND:
                self._panel.teaching.closed()
            raise
        if program.revision != shown.revision:
            self._panel.messages.add(
                f"{name} was changed: revision {program.revision} is shown now,"
                f" in the place of {shown.revision}; no dry run was made of it"
            )
        self._panel.opened(program)

    async def edit(self, edit: ProgramEdit) -> None:
        """Edit the open program."""
        program = self._panel.teaching.program
        if program is None:
            return
        try:
            await self._client.manage(program.request(edit))
        finally:
            # After a refusal too: somebody else may have saved another revision.
            self._panel.opened(await self._load(program.name))

    async def walk(self, name: str) -> None:
        """Request a dry run, which can take seconds; other commands run meanwhile."""
        found: DryRunFindings | None = None
        try:
            answer = await self._client.manage({"op": "programs.dry_run", "name": name})
            program = await self._load(name)
            if program.revision == int(answer["revision"]):
                found = DryRunFindings.read(name, program.revision, answer)
            else:
                self._panel.messages.add(f"{name} was changed meanwhile: . makes a dry run anew")
            if (open_now := self._panel.teaching.program) is not None and open_now.name == name:
                self._panel.opened(program)
        finally:
            self._panel.teaching.walked(found)

    async def _load(self, name: str) -> TaughtProgram:
        text, revision = await self._body(name, "text", None)
        document, _ = await self._body(name, "json", revision)
        return TaughtProgram.read(revision, text, json.loads(document))

    async def _body(self, name: str, form: str, revision: int | None) -> tuple[str, int]:
        """Load one form of a program; a long one arrives in parts."""
        parts: list[str] = []
        offset: int | None = 0
        while offset is not None:
            request = {"op": "programs.load", "name": name, "format": form, "offset": offset}
            answer = await self._client.manage(request | {"revision": revision})
            parts.append(answer["body"])
            revision, offset = int(answer["revision"]), answer["next"]
        assert revision is not None
        return "".join(parts), revision
