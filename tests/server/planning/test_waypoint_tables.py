"""Tables of waypoints in a job: they are what a tuple of the same waypoints is, but small."""

import io
import pickle
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from openpendant.server.planning.jobs import (
    JointPathJob,
    PoseGoal,
    PoseJob,
    read_question,
    split_question,
)
from openpendant.server.planning.waypoint_tables import JointWaypoints, PoseWaypoints
from openpendant.simplemsg.pendant import Motion

JOINTS = ((0.1, -2.0), (1e-300, 3.0), (0.25, 0.5))
POSES = tuple(PoseGoal((at / 8, 0.1, -3.0), (0.0, 1.0, at / 3, 0.0)) for at in range(3))
TABLES: dict[str, tuple[Sequence[Any], tuple[Any, ...]]] = {
    "joints": (JointWaypoints(np.array(JOINTS)), JOINTS),
    "poses": (PoseWaypoints(np.array([(*at.position, *at.orientation) for at in POSES])), POSES),
}

both = pytest.mark.parametrize(("table", "wanted"), TABLES.values(), ids=TABLES)


@both
def test_a_table_is_used_and_told_as_the_tuple_of_its_rows(
    table: Sequence[Any], wanted: tuple[Any, ...]
) -> None:
    assert (tuple(table), len(table), table[-1], table[1:]) == (
        *(wanted, len(wanted), wanted[-1], wanted[1:]),
    )
    assert table == wanted
    assert wanted == table
    assert (repr(table), hash(table)) == (repr(wanted), hash(wanted))
    assert table != wanted[:2]
    with pytest.raises(IndexError):
        table[len(wanted)]


def test_a_job_with_a_table_equals_one_with_a_tuple_and_reads_the_same_in_a_journal() -> None:
    start = (0.0, 0.0)
    jobs = [JointPathJob(1, start, each, 0.5) for each in TABLES["joints"]]
    paths = [PoseJob(1, start, each, "base", Motion.PTP, 0.5) for each in TABLES["poses"]]
    for one, other in (jobs, paths):
        assert one == other
        assert repr(one) == repr(other)
        head, _ = split_question("ur5", one)
        assert read_question(io.BytesIO(head)) == ("ur5", other)


def test_a_long_path_is_pickled_as_the_bytes_of_its_reals() -> None:
    table = PoseWaypoints(np.ones((1_600, 7)))
    data = pickle.dumps(PoseJob(1, (0.0,), table, "base", Motion.PTP, 0.5))
    assert len(data) < 8 * 7 * 1_600 + 1_000
