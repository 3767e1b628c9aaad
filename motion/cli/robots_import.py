"""The command `openpendant robots import`: a robot file from a URDF or a DH table.

Owns arguments, questions on a terminal, and output. What is read or asked goes to standard output,
what is assumed to standard error, so that a script that throws the one away still sees the other.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from openpendant.tools.console import ExitCode, one_line

from ..description.robot import mesh_folder
from ..description.yaml_file import MAX_FILE_BYTES, to_yaml
from ..errors import BadArgument, RobotFileError
from ..robot_import.decisions import Ask, Decisions, FactSource, ImportedFact
from ..robot_import.dh_file import ENDINGS, read_dh_file
from ..robot_import.imported_chain import ImportedChain
from ..robot_import.mesh_keeping import MeshKeeper, stored_meshes
from ..robot_import.new_robot import Wishes, configure, robot_name
from ..robot_import.urdf import read_urdf
from ..robot_import.urdf_tree import chain_to, possible_tips
from .arguments import parse_joints

_SHOWN = 8  # names in a message


def import_robot(
    source: Annotated[
        Path, typer.Argument(metavar="FILE", help="A URDF, or a DH table (CSV, JSON, YAML).")
    ],
    name: Annotated[str | None, typer.Option(help="The robot's name.")] = None,
    tip: Annotated[str | None, typer.Option(help="The link a URDF's chain ends at.")] = None,
    home: Annotated[
        str | None, typer.Option(help="JSON list, one value per driven joint [rad or m].")
    ] = None,
    coupling: Annotated[
        int | None,
        typer.Option(min=-1, max=1, help="Factor of joint 2 in joint 3: 1 FANUC, -1 ABB's rod."),
    ] = None,
    manufacturer: Annotated[str | None, typer.Option(help="Who makes it.")] = None,
    model: Annotated[str | None, typer.Option(help="What they call it.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The robot file; NAME.yaml if not given.")
    ] = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="Refuse what is missing; ask and assume nothing.")
    ] = False,
    yes: Annotated[
        bool, typer.Option("--yes", help="Ask nothing: take every default, replace the file.")
    ] = False,
) -> None:
    """Make a robot file from a URDF or a DH table, in four steps.

    What the description does not say is asked for on a terminal, and assumed aloud elsewhere.
    """
    ask = _ask if sys.stdin.isatty() and sys.stdout.isatty() and not (yes or strict) else None
    wished_name = None if name is None else _wished_name(name)
    wished_home = None if home is None else parse_joints(home, "--home")
    with TemporaryDirectory(prefix="openpendant-meshes-") as folder:
        keeper = MeshKeeper(Path(folder))
        chain = _read(source, tip, ask, keeper)
        decisions = Decisions(str(source), _tell, ask, strict)
        wishes = Wishes(wished_name, wished_home, coupling, manufacturer, model)
        content = configure(chain, wishes, decisions, keeper.folder)
        target = output or Path(f"{content['name']}.yaml")
        text = _text_of(content, source)
        with stored_meshes(content, keeper.folder, mesh_folder(target), str(source)):
            _write(text, target, replace=yes)
    is_sound = _check(target, chain)
    for line in _about_meshes(chain, target):
        print(one_line(line, " "))
    if not is_sound:
        raise typer.Exit(ExitCode.FAILED)


def _wished_name(name: str) -> str:
    if robot_name(name) != name or not name:
        raise BadArgument("--name", name, "lower-case letters, digits and single underscores")
    return name


def _read(source: Path, tip: str | None, ask: Ask | None, keeper: MeshKeeper) -> ImportedChain:
    if source.suffix.lower() in ENDINGS:
        if tip is not None:
            raise BadArgument("--tip", tip, "nothing, for a DH table: it has one chain")
        return read_dh_file(source)
    model = read_urdf(source, keeper)
    if tip is not None:
        return chain_to(model, tip)
    choice = possible_tips(model)
    chosen = choice.tips[0]
    if len(choice.tips) == 1:
        return chain_to(model, chosen)
    tips = ", ".join(choice.tips[:_SHOWN])
    if ask is not None:
        answer = ask(f"tip: the chain could end at {tips}", chosen).strip()
        return chain_to(model, answer or chosen)
    if not choice.clear:
        raise RobotFileError(
            str(source),
            "",
            f"has several arms; accepted: --tip with one of {tips}, or with {choice.fork!r},"
            " where they part",
        )
    return chain_to(model, chosen).with_remarks(
        f"the tip is assumed to be {chosen!r}; with the same motors it could be: {tips}"
    )


def _ask(question: str, default: str) -> str:
    return input(f"{one_line(question, ' ')} [{one_line(default, ' ')}]: ")


def _tell(finding: ImportedFact) -> None:
    line = f"{finding.step:<13} {finding.outcome:<10} {finding.item}: {finding.detail}"
    stream = sys.stderr if finding.outcome is FactSource.DEFAULTED else sys.stdout
    print(one_line(line, " "), file=stream, flush=True)


def _text_of(content: dict[str, Any], source: Path) -> str:
    made = f"# made by openpendant robots import from {one_line(source.name, ' ')}\n"
    text = made + to_yaml(content)
    if len(text.encode()) > MAX_FILE_BYTES:
        raise RobotFileError(str(source), "", f"becomes more than {MAX_FILE_BYTES} bytes")
    return text


def _write(text: str, target: Path, replace: bool) -> None:
    try:
        with target.open("w" if replace else "x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise BadArgument("-o", str(target), "a new file, or --yes to replace this one") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a legal file name"
        raise BadArgument("-o", str(target), f"a file that can be written ({reason})") from None


def _about_meshes(chain: ImportedChain, target: Path) -> Iterator[str]:
    """Return the last lines: what was refused and why; last, which meshes show the robot."""
    refused = chain.refused_meshes
    for mesh in refused[:_SHOWN]:
        yield f"refused: mesh {mesh}"
    if len(refused) > _SHOWN:
        yield f"refused: {len(refused) - _SHOWN} more; the lines of step 1 name each"
    sizes = {mesh.hash: mesh.bytes for mesh in chain.meshes}
    if sizes:
        total = sum(sizes.values()) / (1 << 20)
        kept = f"kept {len(sizes)} meshes of {total:.1f} MiB in {mesh_folder(target)}"
        yield f"{kept}; {len(refused)} refused" if refused else kept
    elif refused:
        yield f"no mesh was kept, {len(refused)} refused: simple shapes show the robot"
    else:
        yield "no mesh was found: simple shapes show the robot"


def _verdict(chain: ImportedChain) -> str:
    """Return what a sound robot is called; what is never checked belongs to it."""
    if chain.collision and not (chain.refused_meshes and chain.unchecked):
        return "good"
    return f"good, but no collision is found of {', '.join(chain.unchecked)}: no shapes"


def _check(target: Path, chain: ImportedChain) -> bool:
    from ..robot_report.robot_check import check_robot

    report = check_robot(target)
    print(one_line(f"wrote {target}: {_verdict(chain) if report.sound else 'BAD'}", " "))
    for line in (*report.problems, *report.remarks):
        print(f"      {one_line(line, ' ')}")
    return report.sound
