import struct
from pathlib import Path

import numpy as np
import pytest

from openpendant.motion.errors import MeshFileError
from openpendant.motion.scene.mesh_file import read_mesh

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]])
FACET = (
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0.5\nendloop\nendfacet"
)


def binary_stl(corners: np.ndarray, count: int | None = None) -> bytes:
    triangle = struct.pack("<12fH", 0.0, 0.0, 1.0, *corners.ravel().tolist(), 0)
    return b"solid, although binary".ljust(80) + struct.pack("<I", count or 1) + triangle


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.stl", binary_stl(CORNERS)),
        ("a.STL", f"solid x\n{FACET}\nendsolid x\n".encode()),
        ("a.obj", b"# x\nv 0 0 0\nv 1 0 0\nv 0 1 0.5\nvn 0 0 1\nf 1/1/1 2//1 3\n"),
        ("b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0.5\nf -3 -2 -1\n"),
    ],
)
def test_a_triangle_is_read_from_every_format(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    mesh = read_mesh(tmp_path / name)
    np.testing.assert_array_equal(mesh.vertices[mesh.corners[0]], CORNERS)


def test_a_polygon_becomes_a_fan(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    assert read_mesh(tmp_path / "a.obj").corners.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize(
    ("name", "content", "place"),
    [
        ("a.ply", b"", ""),
        ("a.stl", b"", "byte 0"),
        ("a.stl", b"\x00" * 50, "byte 50"),
        ("a.stl", binary_stl(CORNERS, count=7).replace(b"solid", b"xxxxx"), "byte 80"),
        ("a.stl", binary_stl(np.full((3, 3), np.nan)), "byte 84"),
        ("a.stl", b"solid x\nendsolid x\n".ljust(90), ""),
        ("a.stl", b"solid x\nfacet\nvertex 1 2\n".ljust(90), "line 3"),
        ("a.stl", b"solid x\nvertex 1 2 nan\n".ljust(90), "line 2"),
        ("a.stl", b"solid x\nvertex 1 2 3\nendfacet\n".ljust(90), "line 3"),
        ("a.stl", b"solid x\nvertex 1 2 3\n".ljust(90), ""),
        ("a.stl", b"solid \xff\xfe".ljust(90), "byte 6"),
        ("a.obj", b"v 1 2 3\nf 1 1 2\n", "line 2"),
        ("a.obj", b"v 1 2 3\nf 1 1 0\n", "line 2"),
        ("a.obj", b"v 1 2 3\nf 1 1\n", "line 2"),
        ("a.obj", b"v 1 2 3\nf 1 1 x\n", "line 2"),
        ("a.obj", b"v 1 2 3\n", ""),
    ],
)
def test_a_bad_mesh_is_refused_where_it_is_bad(
    tmp_path: Path, name: str, content: bytes, place: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshFileError) as refused:
        read_mesh(tmp_path / name)
    assert refused.value.place == place
    assert "\n" not in str(refused.value)


def test_a_missing_mesh_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MeshFileError, match="No such file"):
        read_mesh(tmp_path / "a.stl")
