from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.peers.server_clients import Pendant

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, Management
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def cell() -> Iterator[EmulatedCell]:
    made = EmulatedCell(has_surroundings=True, controller={"signals": "openpendant"})
    made.wait(100)
    yield made
    assert not any(made.controller.referee.counts.values())


def ask(pendant: Pendant, op: str, **fields: Any) -> dict[str, Any]:
    pendant.last_request += 1
    request = Management(pendant.last_request, json.dumps({"op": op, **fields}).encode())
    (reply,) = [each for each in pendant.send(request) if isinstance(each, Management)]
    answer: dict[str, Any] = json.loads(reply.body)
    assert reply.reply_code == ReplyCode.SUCCESS, answer
    return answer


def let_finish(cell: EmulatedCell, pendant: Pendant) -> None:
    for _ in range(400):
        pendant.send(AuthorityBeat())
        cell.wait(100)
        if cell.core.cell.activity is Activity.IDLE:
            return
    raise AssertionError("the motion does not end")


def test_a_motion_is_recorded_and_played_back_softly(cell: EmulatedCell) -> None:
    pendant = cell.holder()
    begin = cell.position
    ask(pendant, "recordings.start", name="swing")
    assert pendant.move(*(value + 0.3 for value in begin), speed=0.2) is V.ACCEPTED
    let_finish(cell, pendant)
    end = cell.position
    assert ask(pendant, "recordings.stop")["gaps"] == 0
    told = ask(pendant, "recordings.play", name="swing", factor=4)
    assert told["approach"] > 0
    assert told["possible"] <= told["recorded"]
    let_finish(cell, pendant)
    assert cell.position == pytest.approx(end, abs=3e-3)
    assert [code for _, code in pendant.outcomes()] == [V.ACCEPTED, V.ACCEPTED]


def test_an_object_put_in_the_way_stops_the_robot_before_it_touches(cell: EmulatedCell) -> None:
    """Promise 17, with the planning process answering at once."""
    pendant = cell.holder()
    goal = (cell.position[0] + 1.5, *cell.position[1:])
    where = Kinematics(serial_robot("ur5")).forward(goal).position.tolist()
    assert pendant.move(*goal, speed=0.3) is V.ACCEPTED
    cell.wait(300)
    ball = {"name": "ball", "shape": {"type": "sphere", "radius": 0.05}, "position": where}
    ask(pendant, "scene.add", object=ball, expected_revision=0)
    let_finish(cell, pendant)
    assert pendant.outcomes()[-1][1] is V.PATH_IN_COLLISION
    assert ask(pendant, "scene.nearest")["distance"] > 0.005
    assert pendant.move(*goal, speed=0.3) is V.PATH_IN_COLLISION


def test_an_output_is_switched_and_an_input_read(cell: EmulatedCell) -> None:
    pendant = cell.holder()
    ask(pendant, "signals.set", output=3, value=True)
    cell.wait(100)
    told = ask(pendant, "signals.read")
    assert [n for n, value in enumerate(told["outputs"]) if value] == [3]
    assert len(told["inputs"]) == 16
