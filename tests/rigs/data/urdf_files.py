"""Small URDF files for tests: a sound one of three axes, and ways to spoil it."""

from pathlib import Path

ROBOTS_FILES = Path(__file__).parents[2] / "robots_files"

LIMIT = '<limit lower="-1" upper="1.5" velocity="2" effort="1"/>'


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    origin: str = '<origin xyz="0.1 0 0.2" rpy="0 0 0"/>',
    axis: str = '<axis xyz="0 0 1"/>',
    limit: str = LIMIT,
    more: str = "",
) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{origin}{axis}{limit}{more}</joint>'


def robot(*joints: str, links: str = "abcd", more: str = "", name: str = "tiny") -> str:
    listed = "".join(f'<link name="{letter}"/>' for letter in links)
    return f'<robot name="{name}">{listed}{"".join(joints)}{more}</robot>'


FIRST = joint("one", "a", "b")
SECOND = joint("two", "b", "c", axis='<axis xyz="0 1 0"/>')
THIRD = joint("three", "c", "d", axis='<axis xyz="0 1 0"/>')
SOUND = robot(FIRST, SECOND, THIRD)


def written(folder: Path, text: str | bytes, name: str = "tiny.urdf") -> Path:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path
