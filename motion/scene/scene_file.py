"""Scene files of schema `openpendant-scene/1`, YAML or JSON.

Owns the file's fields and the errors that name file and field. The meaning of the values and which
are accepted is `scene`'s. A mesh file is found relative to its scene file. Units: m; quaternions
are x, y, z, w.

    schema: openpendant-scene/1
    objects:
    - {name: table, shape: {type: box, size: [1.2, 0.8, 0.05]}, position: [0, 0.6, -0.03]}
    - {name: jig, shape: {type: mesh, file: jig.stl, scale: [0.001, 0.001, 0.001]}, frame: root}
    allowed: [[table, jig]]
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..description.field_problems import Problem, field_problems
from ..description.schema import Name, Real
from ..description.yaml_file import read_mapping
from ..errors import MeshFileError, MotionError, RobotFileError, SceneFileError
from ..steps import Stepwise, at_once
from .scene import (
    MAX_ALLOWED,
    MAX_OBJECTS,
    Box,
    Capsule,
    Cylinder,
    Mesh,
    Scene,
    SceneObject,
    Shape,
    Sphere,
)

SCENE_SCHEMA = "openpendant-scene/1"

_SHOWN = 12  # names in a message

_A_STEP = 64  # objects

# About how long it takes on an ordinary machine [µs].
_PER_CHECKED = 6.0  # object
_PER_OBJECT = 8.0
_PER_JOINED = 0.5  # object or pair

_Vector: TypeAlias = tuple[Real, Real, Real]


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _Box(_Entry):
    type: Literal["box"]
    size: _Vector

    def shape(self) -> Shape:
        return Box(self.size)


class _Sphere(_Entry):
    type: Literal["sphere"]
    radius: Real

    def shape(self) -> Shape:
        return Sphere(self.radius)


class _Cylinder(_Entry):
    type: Literal["cylinder"]
    radius: Real
    length: Real

    def shape(self) -> Shape:
        return Cylinder(self.radius, self.length)


class _Capsule(_Entry):
    type: Literal["capsule"]
    radius: Real
    length: Real

    def shape(self) -> Shape:
        return Capsule(self.radius, self.length)


class _Mesh(_Entry):
    type: Literal["mesh"]
    file: Annotated[str, Field(min_length=1, max_length=1024)]
    scale: _Vector = (1.0, 1.0, 1.0)

    def shape(self) -> Shape:
        return Mesh(self.file, self.scale)


class _Object(_Entry):
    name: Name
    shape: Annotated[_Box | _Sphere | _Cylinder | _Capsule | _Mesh, Field(discriminator="type")]
    position: _Vector = (0.0, 0.0, 0.0)
    quaternion: tuple[Real, Real, Real, Real] = (0.0, 0.0, 0.0, 1.0)
    frame: Literal["base", "root"] = "base"
    link: Name | None = None


class _File(_Entry):
    schema_: Literal["openpendant-scene/1"] = Field(alias="schema")
    objects: Annotated[tuple[_Object, ...], Field(max_length=MAX_OBJECTS)] = ()
    allowed: Annotated[tuple[tuple[Name, Name], ...], Field(max_length=MAX_ALLOWED)] = ()
    revision: Annotated[int, Field(strict=True, ge=0)] = 0


def load_scene(path: str | Path, links: Sequence[str] | None = None) -> Scene:
    """Read a scene file; JSON is read as YAML, of which it is a part.

    Args:
        path: the file.
        links: links of the robot that it is for, to check names of links; None leaves that to the
            module that combines scene and robot.

    Raises:
        SceneFileError: the file cannot be read or is not a sound scene, with the field and what
            would be accepted.
    """
    file = str(path)
    try:
        content = read_mapping(Path(path))
    except RobotFileError as error:
        raise SceneFileError(file, error.field, error.problem) from None
    scene = scene_from_data(content, file, links)
    folder = Path(path).parent
    return replace(scene, objects=tuple(_with_mesh_in(folder, each) for each in scene.objects))


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene file, JSON by its ending or else YAML, or raise `SceneFileError`."""
    data = scene_to_data(scene)
    file = Path(path)
    if file.suffix.lower() == ".json":
        text = json.dumps(data, indent=2, allow_nan=False) + "\n"
    else:
        text = yaml.safe_dump(data, sort_keys=False, default_flow_style=None)
    try:
        file.write_text(text, "utf-8")
    except OSError as error:
        raise SceneFileError(str(path), "", error.strerror or "cannot be written") from error


def unusable_mesh(path: str | Path, scene: Scene, error: MeshFileError) -> SceneFileError:
    """Return the error of a scene file one of whose meshes cannot be used."""
    index = next(
        index
        for index, each in enumerate(scene.objects)
        if isinstance(each.shape, Mesh) and each.shape.file == error.file
    )
    problem = f"names a mesh that cannot be used: {error}; accepted: a sound STL or OBJ file"
    return SceneFileError(str(path), f"objects[{index}].shape.file", problem)


def scene_from_data(
    content: dict[str, Any], source: str, links: Sequence[str] | None = None
) -> Scene:
    """Build a scene from plain data of the schema.

    Args:
        links: links of the robot that it is for; None leaves names of links unchecked.

    Raises:
        SceneFileError: the content is not a sound scene.
    """
    return at_once(read_scene(content, source, links))


def read_scene(
    content: dict[str, Any], source: str, links: Sequence[str] | None = None
) -> Stepwise[Scene]:
    """Build a scene as `scene_from_data` does, in steps."""
    entries = content.get("objects")
    yield _PER_CHECKED * (len(entries) if isinstance(entries, list) else 0)
    if content.get("schema") != SCENE_SCHEMA:
        raise SceneFileError(source, "schema", f"is not {SCENE_SCHEMA!r}, the one schema accepted")
    try:
        read = _File.model_validate(content)
    except ValidationError as error:
        (field, problem), *more = field_problems(error, _File)
        raise SceneFileError(source, field, problem, tuple(more)) from None
    problems = tuple(_name_problems(read, links))
    if problems:
        (field, problem), *more = problems
        raise SceneFileError(source, field, problem, tuple(more))
    objects: list[SceneObject] = []
    for first in range(0, len(read.objects), _A_STEP):
        some = read.objects[first : first + _A_STEP]
        yield _PER_OBJECT * len(some)
        for index, entry in enumerate(some, first):
            try:
                objects.append(_object(entry))
            except MotionError as error:
                where = f"objects[{index}] ({entry.name})"
                raise SceneFileError(source, where, str(error)) from None
    yield _PER_JOINED * (len(objects) + len(read.allowed))
    return Scene(tuple(objects), frozenset(read.allowed), read.revision)


def _object(entry: _Object) -> SceneObject:
    shape = entry.shape.shape()
    return SceneObject(entry.name, shape, entry.position, entry.quaternion, entry.frame, entry.link)


def _name_problems(read: _File, links: Sequence[str] | None) -> Iterator[Problem]:
    # `Scene` and `CollisionModel` have these rules too, but do not know the file's fields.
    names = {entry.name: None for entry in read.objects}
    before: set[str] = set()
    for index, entry in enumerate(read.objects):
        where = f"objects[{index}]"
        is_taken = entry.name in before or entry.name in (links or ())
        before.add(entry.name)
        if is_taken:
            accepted = "a name of no other object and no link"
            yield f"{where}.name", f"is {entry.name!r}, which is taken; accepted: {accepted}"
        if links is not None and entry.link is not None and entry.link not in links:
            accepted = f"a link of the robot: {_list(links)}"
            yield f"{where}.link", f"is {entry.link!r}; accepted: {accepted}"
    for index, pair in enumerate(read.allowed):
        where = f"allowed[{index}]"
        if pair[0] == pair[1]:
            yield where, f"is {list(pair)}; accepted: two different names"
        elif pair[0] not in names and pair[1] not in names:
            yield where, f"is {list(pair)}; accepted: a pair with an object: {_list(tuple(names))}"
        elif links is not None:
            for place, name in enumerate(pair):
                if name not in names and name not in links:
                    accepted = f"an object: {_list(tuple(names))}; or a link: {_list(links)}"
                    yield f"{where}[{place}]", f"is {name!r}; accepted: {accepted}"


def _list(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_SHOWN]) or "none"
    return f"{shown} and {len(names) - _SHOWN} more" if len(names) > _SHOWN else shown


def scene_to_data(scene: Scene) -> dict[str, Any]:
    """Return a scene as plain data of the schema."""
    return {
        "schema": SCENE_SCHEMA,
        "revision": scene.revision,
        "objects": [object_to_data(each) for each in scene.objects],
        "allowed": [list(pair) for pair in sorted(scene.allowed)],
    }


def object_to_data(each: SceneObject) -> dict[str, Any]:
    """Return an object of a scene as plain data of the schema."""
    data: dict[str, Any] = {
        "name": each.name,
        "shape": _shape_data(each.shape),
        "position": list(each.position),
        "quaternion": list(each.quaternion),
        "frame": each.frame,
    }
    return data if each.link is None else data | {"link": each.link}


def _shape_data(shape: Shape) -> dict[str, Any]:
    match shape:
        case Box(size):
            return {"type": "box", "size": list(size)}
        case Sphere(radius):
            return {"type": "sphere", "radius": radius}
        case Cylinder(radius, length):
            return {"type": "cylinder", "radius": radius, "length": length}
        case Capsule(radius, length):
            return {"type": "capsule", "radius": radius, "length": length}
        case Mesh(file, scale):
            return {"type": "mesh", "file": file, "scale": list(scale)}


def _with_mesh_in(folder: Path, each: SceneObject) -> SceneObject:
    if not isinstance(each.shape, Mesh):
        return each
    return replace(each, shape=replace(each.shape, file=str(folder / each.shape.file)))
