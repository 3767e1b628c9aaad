"""Promise 39: a change is told to everybody who wants to know, just behind its acknowledgement."""

import json
import time
from pathlib import Path

import pytest
from promises.promise_figures import Figures, trials_of
from promises.promise_table import figure
from rigs.peers.wire_pendant import WirePendant
from rigs.processes.promise_rig import promise_rig

from openpendant.simplemsg import Message, ReplyCode
from openpendant.simplemsg.pendant import (
    Change,
    Declare,
    DocumentChanged,
    Management,
    NoticeKind,
    Notices,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(3_600)]

LATE = figure(39, "late")
LOOK = 0.0005
"""So long each of both ends is listened to in turn [s]."""


def wait_for(pendant: WirePendant, kind: type[Message]) -> tuple[Message, int]:
    """Return the first message of a kind that comes, and when it had come [ns]."""
    until = time.monotonic() + 10.0
    while time.monotonic() < until:
        for each in pendant.got:
            if isinstance(each, kind):
                return each, time.monotonic_ns()
        pendant.listen(LOOK)
    raise AssertionError(f"no {kind.__name__} came")


@pytest.mark.parametrize(("trials", "slack"), trials_of(LATE))
def test_promise_39_a_change_is_told_within_30_ms_of_its_acknowledgement(
    tmp_path: Path, trials: int, slack: float
) -> None:
    figures = Figures("promise 39, acknowledged to told")
    with promise_rig(tmp_path) as rig:
        maker, watcher = rig.pendant("maker"), rig.pendant("watcher")
        assert watcher.verdict(Declare(1, 0.0, Notices.WANTED, "en")) is V.ACCEPTED
        while figures.need_more(trials, LATE.ms, slack):
            name = f"p{len(figures.delays)}"
            maker.got.clear()
            watcher.got.clear()
            asked = maker.send(
                Management(7, json.dumps({"op": "programs.create", "name": name}).encode())
            )
            answer, acknowledged = wait_for(maker, Management)
            assert answer.reply_code == ReplyCode.SUCCESS
            notice, told = wait_for(watcher, DocumentChanged)
            assert isinstance(notice, DocumentChanged)
            found = (notice.kind, notice.what, notice.name)
            assert found == (NoticeKind.PROGRAM, Change.NEW, name)
            figures.take(asked, max((told - acknowledged) / 1e6, 0.0))
            figures.idle.append(rig.idle_delay())
    figures.judge(LATE.ms, slack=slack)
