"""The cell of the pictures: what stands in it, which positions and which program it knows."""

from __future__ import annotations

from typing import Any

from openpendant.tools.pendants.sync_client import SyncPendantClient

POINTS = {
    "rest": (-0.9, 0.0, -1.570796, 0.0, -1.570796, 0.9),
    "above_bin": (-0.6787, 0.066, -1.8709, 0.0, -1.2047, 0.6787),
    "pick": (-0.6787, 0.1893, -1.9904, 0.0, -0.9619, 0.6787),
    "over_pillar": (0.0, 0.3024, -0.5933, 0.0, -2.2459, 0.0),
    "place": (0.6787, 0.1893, -1.9904, 0.0, -0.9619, -0.6787),
    "above_table": (0.6787, 0.066, -1.8709, 0.0, -1.2047, -0.6787),
}
"""Joint positions [rad] of a Kawasaki RA10N whose gripper points down."""

START = str(list(POINTS["above_bin"]))

_OBJECTS: list[tuple[str, dict[str, Any], tuple[float, float, float]]] = [
    ("bin", {"type": "box", "size": [0.36, 0.36, 0.4]}, (-0.5, 0.62, 0.2)),
    ("table", {"type": "box", "size": [0.4, 0.4, 0.4]}, (0.5, 0.62, 0.2)),
    ("pillar", {"type": "box", "size": [0.14, 0.14, 1.1]}, (0.0, 0.84, 0.55)),
    ("part", {"type": "box", "size": [0.06, 0.06, 0.06]}, (-0.5, 0.62, 0.431)),
    ("fence", {"type": "box", "size": [1.8, 0.02, 1.2]}, (0.4, 1.5, 0.6)),
    ("camera", {"type": "cylinder", "radius": 0.05, "length": 0.16}, (-0.95, 0.2, 0.08)),
]

_STATEMENTS = """
move PTP rest speed 50 %
loop 1
  move PTP above_bin speed 60 %
  move LIN pick speed 50 mm/s
  set output 1 on
  attach part
  move LIN above_bin speed 250 mm/s zone 20 mm
  move PTP over_pillar speed 40 % zone 5 deg
  move LIN place speed 100 mm/s
  detach part
end
move PTP above_table speed 50 %
"""


def program() -> str:
    """Return the text of the program `pick`."""
    points = [
        f"point {name} joints {' '.join(str(each) for each in joints)} rad"
        for name, joints in POINTS.items()
    ]
    return (
        "\n".join(
            ("openpendant-program/1", 'program "pick" robot kawasaki_ra10n tool gripper', *points)
        )
        + _STATEMENTS
    )


def furnish(pendant: SyncPendantClient) -> None:
    """Give a cell its gripper, objects, positions and program; the client holds control."""
    revision = pendant.frames.show()["tools_revision"]
    added = pendant.tools.add("gripper", {"position": (0.0, 0.0, 0.12)}, revision)
    pendant.tools.select("gripper", added["revision"])
    revision = pendant.scene.show()["revision"]
    for name, shape, position in _OBJECTS:
        new = {"name": name, "shape": shape, "position": list(position)}
        revision = pendant.scene.add(new, revision)["revision"]
    revision = pendant.positions.list()["revision"]
    for name in ("above_bin", "above_table"):
        saved = pendant.positions.save(name, revision, joints=POINTS[name])
        revision = saved["revision"]
    pendant.programs.save("pick", program(), 0)
