import numpy as np
import pytest

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.tools.bench import __main__ as program
from openpendant.tools.bench import codec, ik
from openpendant.tools.bench.ik import Eaik, Toolbox
from openpendant.tools.bench.table import Benchmark, MissingRequirement, measure

KINEMATICS = [Kinematics(serial_robot(name)) for name in ik.FAMILIES]


@pytest.mark.parametrize("kinematics", KINEMATICS, ids=ik.FAMILIES)
def test_eaik_is_asked_what_we_are_and_chooses_as_we_do(kinematics: Kinematics) -> None:
    pytest.importorskip("eaik.IK_HP", reason="EAIK is not installed")
    peer = Eaik(kinematics)
    for question in ik.questions(kinematics, 20):
        theirs, ours = peer.answer(question), ik.answer(kinematics, question)
        assert theirs is not None
        assert ours is not None
        np.testing.assert_allclose(theirs, ours, atol=1e-6)


@pytest.mark.parametrize("kinematics", KINEMATICS, ids=ik.FAMILIES)
def test_the_toolbox_is_asked_what_we_are(kinematics: Kinematics) -> None:
    pytest.importorskip("roboticstoolbox", reason="roboticstoolbox is not installed")
    peer = Toolbox(kinematics)
    answers = [(each.pose, peer.answer(each)) for each in ik.questions(kinematics, 10)]
    reached = [(pose, kinematics.forward(found)) for pose, found in answers if found is not None]
    assert len(reached) >= 8
    for asked, found in reached:
        assert found.position_distance(asked) < 1e-5
        assert found.rotation_distance(asked) < 1e-5


@pytest.mark.parametrize("benchmark", ik.benchmarks(), ids=lambda benchmark: benchmark.name)
def test_each_row_can_be_measured(benchmark: Benchmark, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ik, "POSES", 3)
    try:
        row = measure(benchmark, quick=True)
    except MissingRequirement as missing:
        pytest.skip(str(missing))
    assert row.median > 0.0
    assert (row.baseline is not None) == ("/" in row.name)


def test_a_row_whose_peer_is_not_installed_is_left_out_aloud(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(module: str) -> None:
        raise ImportError(module)

    rows = [row for row in ik.benchmarks() if row.name.endswith("all branches / EAIK")]
    monkeypatch.setattr(ik, "import_module", absent)
    monkeypatch.setattr(codec, "benchmarks", lambda: rows)
    monkeypatch.setattr(program, "MODULES", ("codec",))
    assert program.main([]) == 0
    assert "is left out: EAIK is not installed" in capsys.readouterr().err
