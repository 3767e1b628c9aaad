"""Drawing of a robot's visuals: flat coloured polygons seen by a camera, as SVG or PNG.

Owns the facets of each solid, their shading, and the projection: orthographic or perspective, after
J. F. Hughes et al., "Computer Graphics: Principles and Practice", ch. 7 and 13.

Owns what hides what. An SVG has the polygons in painter's order, the farthest first. A PNG is
filled point by point with the nearest facet, each point being the mean of several samples: shapes
of neighbouring links stand in each other, and no order of painting shows where one ends. Both files
are written by matplotlib, which is imported when a picture is asked for.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..description.robot import ParallelRobot, Robot, SerialRobot
from ..errors import BadArgument, WrongJointCount
from ..kinematics.serial import Kinematics
from ..pose import Array, Pose
from .visuals import RobotVisuals, ShapeForm, VisualShape, robot_visuals

_ROUND = 28  # facets around a round solid
_CAP = 5  # rings of a cap
_CELL = 0.08  # the longest side of a flat facet, of the picture's size: see `Facet`
_LIGHT = np.array([0.35, -0.55, 0.76])  # towards the light, in the root frame
_AMBIENT = 0.55
_TILE_COLOURS = ("#f4f6f8", "#e9edf1")


@dataclass(frozen=True, slots=True)
class View:
    """The direction of the camera: it looks at the middle of the robot, z up.

    Attributes:
        azimuth: from the root's x towards its y [rad].
        elevation: above the horizon [rad], less than a quarter turn to either side.
        perspective: things further away are smaller; else all are to scale.

    Raises:
        BadArgument: an angle is not finite, or the camera would look straight down or up.
    """

    azimuth: float = math.radians(-58.0)
    elevation: float = math.radians(18.0)
    perspective: bool = False

    def __post_init__(self) -> None:
        angles = (self.azimuth, self.elevation)
        if not all(map(math.isfinite, angles)) or abs(self.elevation) >= math.pi / 2.0:
            raise BadArgument(
                "azimuth and elevation", angles, "finite, and less than a quarter turn"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Facet:
    """A convex polygon of the picture.

    Attributes:
        points: (k, 2) x to the right and y up, the picture's shorter half being 1.
        depths: (k,) how far each corner is behind the picture's middle, in the same unit.
        colour: red, green, blue, 0 to 255.
    """

    points: Array
    depths: Array
    colour: tuple[int, int, int]


def draw(
    robot: Robot, joint_position: Sequence[float] | None = None, view: View | None = None
) -> tuple[Facet, ...]:
    """Return the polygons that show a robot on a tiled floor, the farthest first.

    The joint position is (n,) controller-side [rad or m], for a parallel robot its pose variables
    about home; home if None.

    Raises:
        WrongJointCount, NotFinite: not one finite value per driven joint.
    """
    visuals = robot_visuals(robot)
    places = link_poses(robot, joint_position)
    polygons = list(_polygons(visuals, places))
    corners = np.vstack([corner for corner, _ in polygons])
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float(np.linalg.norm(high - low)) / 2.0
    camera = _Camera(view or View(), (low + high) / 2.0, size)
    floor = [facet for tile in _floor(low, high) for facet in camera.facets(*tile, shaded=False)]
    shown = [facet for each in polygons for facet in camera.facets(*each, shaded=True)]
    shown.sort(key=lambda facet: -float(facet.depths.mean()))
    return (*floor, *shown)


def link_poses(robot: Robot, joint_position: Sequence[float] | None = None) -> dict[str, Pose]:
    """Return every link's pose in the root link's frame [m], for a joint position as of `draw`."""
    if isinstance(robot, ParallelRobot):
        variables = robot.home if joint_position is None else joint_position
        if len(variables) != robot.dof:
            raise WrongJointCount(len(variables), robot.dof)
        x, y, z, roll, pitch, yaw = variables
        platform = Pose.from_rpy((x, y, z + robot.home_height), (roll, pitch, yaw))
        return {robot.root_link: Pose.identity(), robot.tool_link: platform}
    return _chain_poses(robot, joint_position)


def _chain_poses(robot: SerialRobot, joint_position: Sequence[float] | None) -> dict[str, Pose]:
    kinematics = Kinematics(robot)
    position = robot.home_position if joint_position is None else joint_position
    return {link: kinematics.forward(position, "root", link) for link in robot.links}


def shape_polygons(shape: VisualShape) -> Iterator[Array]:
    """Yield a shape's outer polygons, (k, 3) in its link's frame, anticlockwise from outside."""
    for polygon in _solid(shape.form, shape.size):
        yield shape.pose.position + polygon @ shape.pose.rotation.T


def _polygons(visuals: RobotVisuals, places: dict[str, Pose]) -> Iterator[tuple[Array, str]]:
    for shape in visuals.shapes:
        place = places[shape.link]
        rotation = place.rotation
        for polygon in shape_polygons(shape):
            yield place.position + polygon @ rotation.T, shape.colour
    for strut in visuals.struts:
        first, second = (
            places[link].compose(Pose.from_values(point, (0.0, 0.0, 0.0, 1.0))).position
            for link, point in ((strut.first_link, strut.first), (strut.second_link, strut.second))
        )
        span = float(np.linalg.norm(second - first))
        axes = _frame_along((second - first) / span)
        for polygon in _solid(ShapeForm.CYLINDER, (strut.diameter, strut.diameter, span)):
            yield (first + second) / 2.0 + polygon @ axes.T, strut.colour


def _frame_along(direction: Array) -> Array:
    """Return (3, 3) axes whose z is a (3,) unit direction."""
    helper = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return np.column_stack((x, np.cross(direction, x), direction))


def _solid(form: ShapeForm, size: tuple[float, float, float]) -> Iterator[Array]:
    if form is ShapeForm.BOX:
        yield from _box(np.array(size) / 2.0)
        return
    radius, half = size[0] / 2.0, size[2] / 2.0
    if form is ShapeForm.CYLINDER:
        profile = [(0.0, -half), (radius, -half), (radius, half), (0.0, half)]
    else:
        straight = max(0.0, half - radius)
        angles = np.linspace(0.0, math.pi / 2.0, _CAP + 1)
        cap = [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]
        upper = [(r, straight + z) for r, z in cap]
        profile = [*((r, -z) for r, z in reversed(upper)), *upper]
    yield from _turned(profile)


def _box(half: Array) -> Iterator[Array]:
    for axis in range(3):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        for side in (-1.0, 1.0):
            face = np.zeros((4, 3))
            face[:, axis] = side * half[axis]
            face[:, first] = half[first] * np.array([-1.0, 1.0, 1.0, -1.0]) * side
            face[:, second] = half[second] * np.array([-1.0, -1.0, 1.0, 1.0])
            yield face


def _turned(profile: Sequence[tuple[float, float]]) -> Iterator[Array]:
    """Yield the facets of a profile of (radius, z), lowest first, turned about z."""
    angles = np.linspace(0.0, 2.0 * math.pi, _ROUND + 1)
    circle = np.column_stack((np.cos(angles), np.sin(angles)))
    for (below, low), (above, high) in pairwise(profile):
        for start, end in pairwise(circle):
            corners = [
                (*(below * start), low),
                (*(below * end), low),
                (*(above * end), high),
                (*(above * start), high),
            ]
            if below == 0.0:
                corners = corners[1:]
            elif above == 0.0:
                corners = corners[:3]
            yield np.array(corners)


def _floor(low: Array, high: Array) -> Iterator[tuple[Array, str]]:
    centre, reach = (low + high) / 2.0, 0.75 * float(max(high[:2] - low[:2]))
    tile = reach / 4.0
    for column in range(-4, 4):
        for row in range(-4, 4):
            x, y = centre[0] + column * tile, centre[1] + row * tile
            colour = _TILE_COLOURS[(column + row) % 2]
            corners = ((x, y), (x + tile, y), (x + tile, y + tile), (x, y + tile))
            yield np.array([(*corner, low[2]) for corner in corners]), colour


class _Camera:
    """Projects polygons of the root frame into the picture."""

    def __init__(self, view: View, centre: Array, size: float) -> None:
        ca, sa = math.cos(view.azimuth), math.sin(view.azimuth)
        ce, se = math.cos(view.elevation), math.sin(view.elevation)
        towards = np.array([ce * ca, ce * sa, se])
        right = np.array([-sa, ca, 0.0])
        self._axes = np.vstack((right, np.cross(towards, right), towards))
        self._towards, self._centre, self._size = towards, centre, size
        self._distance = 3.5 if view.perspective else math.inf

    def facets(self, polygon: Array, colour: str, shaded: bool) -> Iterator[Facet]:
        """Yield what is seen of a (k, 3) polygon: nothing if it faces away."""
        local = (polygon - self._centre) @ self._axes.T / self._size
        normal = np.cross(local[1] - local[0], local[2] - local[1])
        eye = np.array([0.0, 0.0, 1.0])
        if math.isfinite(self._distance):
            eye = np.array([0.0, 0.0, self._distance]) - local[0]
        if float(normal @ eye) <= 0.0:
            return
        shade = _shade(polygon) if shaded else 1.0
        tone = _tone(colour, shade)
        pieces = _cells(local) if shaded and len(local) == 4 else [local]
        for piece in pieces:
            scale = 1.0 / (1.0 - piece[:, 2] / self._distance)
            yield Facet(piece[:, :2] * scale[:, None], -piece[:, 2], tone)


def _cells(quadrilateral: Array) -> Iterable[Array]:
    # Facets are sorted by their middle, so large ones are cut where they could hide the wrong way.
    a, b, c, d = quadrilateral
    across = max(1, math.ceil(float(np.linalg.norm(b - a)) / _CELL))
    along = max(1, math.ceil(float(np.linalg.norm(d - a)) / _CELL))
    for i in range(across):
        for j in range(along):
            corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
            fractions = [(u / across, v / along) for u, v in corners]
            yield np.array(
                [
                    (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
                    for u, v in fractions
                ]
            )


def _shade(polygon: Array) -> float:
    # Lambert's law, with the shadow side not black.
    normal = np.cross(polygon[1] - polygon[0], polygon[2] - polygon[1])
    length = float(np.linalg.norm(normal))
    cosine = float(normal @ _LIGHT) / length if length > 0.0 else 0.0
    return _AMBIENT + (1.0 - _AMBIENT) * max(0.0, cosine)


def _tone(colour: str, shade: float) -> tuple[int, int, int]:
    red, green, blue = (round(shade * int(colour[i : i + 2], 16)) for i in (1, 3, 5))
    return red, green, blue


Pixels: TypeAlias = NDArray[np.uint8]

SIZE = 720
"""Width and height of a picture in points."""

_MARGIN = 1.06  # of the half picture that the drawing fills
_SAMPLES = 2  # per point and direction
_EDGE = 1e-9
_PER_INCH = 96.0  # points of a picture, as browsers show an SVG that is measured in inches
_WHITE = 255


def write_picture(facets: Sequence[Facet], path: Path, title: str) -> None:
    """Write a picture; its format is told by the ending, `.svg` or `.png`.

    Raises:
        BadArgument: another ending, or the file cannot be written.
        ModuleNotFoundError: matplotlib is not installed.
    """
    match path.suffix.lower():
        case ".svg":
            content = svg(facets, title)
        case ".png":
            content = png(facets)
        case other:
            raise BadArgument("picture", str(path), f".svg or .png, not {other!r}")
    try:
        path.write_bytes(content)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not a legal file name"
        raise BadArgument("picture", str(path), f"a file that can be written ({reason})") from error


def svg(facets: Sequence[Facet], title: str) -> bytes:
    """Return an SVG document, the same each time."""
    from matplotlib import rc_context
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    figure = Figure(figsize=(SIZE / _PER_INCH, SIZE / _PER_INCH))
    bounds = (-_MARGIN, _MARGIN)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=bounds, ylim=bounds)
    axes.set_axis_off()
    # The stroke covers the hairline that smoothing leaves between neighbours.
    polygons = PolyCollection(
        [facet.points for facet in facets],
        facecolors=np.array([facet.colour for facet in facets]) / _WHITE,
        edgecolors="face",
        linewidths=0.45,
        clip_on=False,
    )
    axes.add_collection(polygons, autolim=False)
    facts = {"Title": "".join(c if c.isprintable() else " " for c in title), "Date": None}
    file = io.BytesIO()
    with rc_context({"svg.hashsalt": "openpendant"}):
        figure.savefig(file, format="svg", metadata=facts)
    return file.getvalue()


def png(facets: Sequence[Facet]) -> bytes:
    """Return a PNG file's bytes, 8 bits for each colour."""
    from matplotlib.image import imsave

    file = io.BytesIO()
    imsave(file, raster(facets), format="png")
    return file.getvalue()


def raster(facets: Sequence[Facet]) -> Pixels:
    """Return the picture's (height, width, 3) points."""
    fine = SIZE * _SAMPLES
    colours = np.full((fine, fine, 3), _WHITE, np.uint8)
    nearest = np.full((fine, fine), np.inf)
    for facet in facets:
        _fill(facet, colours, nearest)
    samples = colours.reshape(SIZE, _SAMPLES, SIZE, _SAMPLES, 3).astype(np.uint16)
    count = _SAMPLES * _SAMPLES
    points: Pixels = ((samples.sum(axis=(1, 3)) + count // 2) // count).astype(np.uint8)
    return points


def _fill(facet: Facet, colours: Pixels, nearest: Array) -> None:
    corners = _on_screen(facet.points, len(nearest))
    low = np.clip(np.floor(corners.min(axis=0)).astype(int), 0, len(nearest))
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + 1, 0, len(nearest))
    if (low >= high).any():
        return
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    # A point is inside a convex polygon if it is on the same side of every edge.
    sides = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    inside = np.all([side <= _EDGE for side in sides], axis=0)
    depth = _depth_at(corners, facet.depths, x, y)
    place = (slice(low[1], high[1]), slice(low[0], high[0]))
    shown = inside & (depth < nearest[place])
    nearest[place][shown] = depth[shown]
    colours[place][shown] = facet.colour


def _depth_at(corners: Array, depths: Array, x: Array, y: Array) -> Array:
    """Return the depth of the facet's plane at points, by a plane through its corners."""
    system = np.column_stack((corners, np.ones(len(corners))))
    (per_x, per_y, constant), *_ = np.linalg.lstsq(system, depths, rcond=None)
    plane: Array = per_x * x + per_y * y + constant
    return plane


def _on_screen(points: Array, size: int) -> Array:
    """Return (k, 2) points in picture units: from the top left corner, y down."""
    half = size / 2.0
    screen: Array = half + points * np.array([1.0, -1.0]) * half / _MARGIN
    return screen
