"""What is checked of a hull before coal is given it."""

import re
from pathlib import Path

import numpy as np
import pytest
from rigs.data.mesh_files import CUBE_FACES, cube, prism

from openpendant.motion.errors import MeshFileError
from openpendant.motion.scene import hull_file
from openpendant.motion.scene.hull_file import hull_fault, hull_name, hull_text, read_hull
from openpendant.motion.scene.mesh_file import Triangles

FACES = np.array(CUBE_FACES)


def test_a_hull_comes_back_to_the_bit(tmp_path: Path) -> None:
    points, faces = prism(7, 0.1 / 3.0, 0.3)
    content = hull_text(Triangles(points, np.array(faces)))
    path = tmp_path / f"{hull_name(content)}.obj"
    path.write_bytes(content)
    hull = read_hull(path)
    assert np.array_equal(hull.vertices, points)
    assert np.array_equal(hull.corners, faces)


def test_the_largest_hull_fits_its_file() -> None:
    # Each point takes 3 reals of 24 characters, each of twice as many faces 3 numbers of 5.
    line, face = len("v   \n") + 3 * 24, len("f   \n") + 3 * 5
    assert hull_file.MAX_HULL_POINTS * (line + 2 * face) < hull_file.MAX_HULL_BYTES


def test_a_file_of_another_name_is_no_hull(tmp_path: Path) -> None:
    path = tmp_path / f"{'0' * 64}.obj"
    path.write_bytes(hull_text(Triangles(cube(), FACES)))
    with pytest.raises(MeshFileError, match="is not the hull that was made"):
        read_hull(path)


def test_a_sound_hull_has_no_fault() -> None:
    assert hull_fault(Triangles(cube(), FACES)) is None


def dented() -> Triangles:
    points = cube()
    points[6] *= 0.2
    return Triangles(points, FACES)


def holed() -> Triangles:
    faces = FACES.copy()
    faces[0] = faces[1]
    return Triangles(cube(), faces)


@pytest.mark.parametrize(
    ("hull", "fault"),
    [
        (Triangles(cube()[:3], FACES[:1] * 0), "has 3 points"),
        (Triangles(np.vstack((cube(), [[0, 0, 0]])), FACES), "a point is on no face"),
        (Triangles(cube(), FACES[:-1]), "do not close"),
        (holed(), "do not close"),
        (
            Triangles(np.vstack((cube(), cube() + 1.0)), np.vstack((FACES, FACES + 8))),
            "do not close",
        ),
        (Triangles(cube((1.0, 1.0, 0.0)), FACES), "no volume"),
        (Triangles(cube((0.0, 0.0, 0.0)), FACES), "no volume"),
        (Triangles(cube(), FACES[:, ::-1]), "look inwards"),
        (dented(), "not convex"),
    ],
)
def test_what_is_no_hull_is_told(hull: Triangles, fault: str) -> None:
    found = hull_fault(hull)
    assert found is not None
    assert re.search(fault, found), found
