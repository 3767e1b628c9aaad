from __future__ import annotations

import pytest
from rigs.cells.robot_cell_situations import codes, moving
from rigs.cells.server_rig import MS

from openpendant.motion.trajectory.trajectory import Row
from openpendant.server.cell.execution.setpoint_sources import StoredRows
from openpendant.server.events.effects import SendStop, SendToController
from openpendant.simplemsg.pendant import StopChanged, StopKind
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize(
    "fault",
    [{"position": [9.0, 0.0]}, {"velocity": [9.0, 0.0]}, {"position": [float("nan"), 0.0]}],
    ids=["position", "velocity", "no number"],
)
def test_a_sample_that_became_faulty_does_not_leave(
    fault: dict[str, list[float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    rig, pendant = moving()
    take, sent = StoredRows.take, len(rig.points)

    def faulty(rows: StoredRows) -> Row:
        row = take(rows)
        return Row(
            row.time,
            fault.get("position", row.position),
            fault.get("velocity", row.velocity),
            row.acceleration,
        )

    monkeypatch.setattr(StoredRows, "take", faulty)
    rig.now += 10 * MS
    rig.report()
    out = rig.tick()
    assert isinstance(out[0], SendStop)
    assert not any(isinstance(item, SendToController) for item in out)
    (told,) = pendant.all(StopChanged)
    assert told.stop == StopKind.PROTECTIVE
    assert codes(pendant) == [V.CERTIFICATE_REFUSED]
    monkeypatch.undo()
    rig.wait(500)
    assert len(rig.points) == sent
