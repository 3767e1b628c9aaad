"""On values that may be old no key begins or resumes a motion, by whichever way it is asked for."""

import asyncio
from typing import Any, get_args

import pytest
from rigs.cells.panel_rig import MS, PanelRig
from rigs.peers.scripted_pendant_server import ScriptedPendantServer

from openpendant.simplemsg import pendant as messages
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel.commands import Command
from openpendant.tools.pendants.panel.panel import Panel
from openpendant.tools.pendants.panel.performer import Performer

ENTER = "enter"
LATER = 100 * MS

MOVING: list[tuple[type[Command], tuple[str, ...]]] = [
    (do.StepJog, ("q",)),
    (do.PulseJog, ("/", "q")),
    (do.UndoJog, ("b",)),
    (do.GoHome, ("0", "1")),
    (do.GoHome, ("0", "2")),
    (do.MoveJoints, ("=", *"3=5", ENTER)),
    (do.MoveToPose, ("=", *"z=400", ENTER)),
    (do.RunProgram, ("5", "1")),
    (do.RunProgram, ("5", "2")),
    (do.RunProgram, ("5", "3")),
    (do.RunProgram, ("6",)),
    (do.RunProgram, ("7",)),
    (do.ResumeRobot, ("8",)),
    (do.PlayBack, ("down", ENTER, "1")),
    (do.ExecutePlan, (ENTER, ENTER, "1")),
]
"""Every command that begins or resumes a motion, with the keys that ask for it."""

OF_HELD_KEYS = {do.PressJog, do.HoldMotion}
"""What only a pendant asks for that sees a key come up; the keypad's tests try these."""

PLAN = {
    "plan": 7,
    "state": "ready",
    "kind": "ptp",
    "label": "",
    "maker": "bench",
    "duration": 1.0,
    "samples": 101,
    "expires_in": 60.0,
    "text": "",
}


def ready(kind: type[Command], *, walked: bool = True) -> PanelRig:
    """Return a pendant on which everything could be asked for."""
    rig = PanelRig()
    rig.open()
    if walked:
        rig.walk()
    if kind is do.PlayBack:
        recordings = {"recording": None, "recordings": [{"name": "pick"}]}
        rig.panel.told_list(do.CellList.RECORDINGS, recordings)
    if kind is do.ExecutePlan:
        rig.panel.told_list(do.CellList.PLANS, {"plans": [PLAN]})
    rig.state(
        activity=messages.Activity.PAUSED if kind is do.ResumeRobot else messages.Activity.IDLE
    )
    return rig


def struck(rig: PanelRig, *keys: str) -> list[Command]:
    """Strike keys at one moment on values as they are, and let a step leave."""
    asked = [command for key in keys for command in rig.panel.key(key, rig.now)]
    return [*asked, *rig.panel.tick(rig.now + LATER)]


def asked_at_most(kind: type[Command]) -> list[Command]:
    """Return what a key may ask for on values that may be old: what was paused may move by now."""
    return [do.PauseRobot()] if kind is do.ResumeRobot else []


@pytest.mark.parametrize(("kind", "keys"), MOVING)
def test_keys_move_on_fresh_values(kind: type[Command], keys: tuple[str, ...]) -> None:
    (asked,) = struck(ready(kind), *keys)
    assert type(asked) is kind


@pytest.mark.parametrize(("kind", "keys"), MOVING)
def test_the_same_keys_move_nothing_on_values_of_0_3_s(
    kind: type[Command], keys: tuple[str, ...]
) -> None:
    rig = ready(kind)
    rig.now += 301 * MS
    assert struck(rig, *keys) == asked_at_most(kind)
    assert rig.said.startswith("STALE")


@pytest.mark.parametrize("changes", [{"link": messages.LinkState.STALE}, {"age": 0.4}])
@pytest.mark.parametrize(("kind", "keys"), MOVING)
def test_nor_on_fresh_messages_about_an_old_report(
    kind: type[Command], keys: tuple[str, ...], changes: dict[str, Any]
) -> None:
    rig = ready(kind)
    rig.state(activity=rig.panel.cell.state and rig.panel.cell.state.activity, **changes)
    assert struck(rig, *keys) == asked_at_most(kind)
    assert rig.said.startswith("STALE")


@pytest.mark.parametrize(("kind", "keys"), [each for each in MOVING if len(each[1]) > 1])
def test_a_yes_after_the_values_went_stale_moves_nothing(
    kind: type[Command], keys: tuple[str, ...]
) -> None:
    rig = ready(kind)
    *question, answer = keys
    assert struck(rig, *question) == []
    rig.now += 301 * MS
    assert struck(rig, answer) == []
    assert rig.panel.question is None
    assert rig.said.startswith("STALE")


def test_nor_does_the_second_yes_that_a_run_without_a_dry_run_wants() -> None:
    rig = ready(do.RunProgram, walked=False)
    assert struck(rig, "5", "1") == []
    rig.now += 301 * MS
    assert struck(rig, "5") == []
    rig.state()
    assert struck(rig, "5", "1", "5") == [do.RunProgram("pick", 3, messages.RunKind.ALL)]


def test_the_table_has_every_command_that_moves_and_all_others_are_known_to_move_nothing() -> None:
    assert {kind for kind, _ in MOVING} | OF_HELD_KEYS == set(get_args(do.BeginsMotion))
    assert set(get_args(Command)) - set(get_args(do.BeginsMotion)) == {
        do.StopRobot,
        do.UnlatchStop,
        do.AimJog,
        do.FeedBeat,
        do.ReleaseJog,
        do.LetGoMotion,
        do.AskRetreat,
        do.TakeControl,
        do.GiveControl,
        do.Enable,
        do.ChangeMode,
        do.ChangeSpeed,
        do.AskWhy,
        do.AskPrograms,
        do.AskList,
        do.RecordMotion,
        do.EndRecording,
        do.ChooseTool,
        do.SwitchOutput,
        do.TeachPosition,
        do.ForgetPosition,
        do.PlanWay,
        do.ForgetPlan,
        do.AskPairingCode,
        do.EndPairing,
        do.MakeProgram,
        do.OpenProgram,
        do.ReloadProgram,
        do.ApplyEdit,
        do.AskDryRun,
        do.PauseRobot,
        do.StopProgram,
    }


@pytest.mark.parametrize("key", ["9", "x", "c", "?"])
def test_what_moves_nothing_is_asked_for_on_stale_values_too(key: str) -> None:
    rig = ready(do.StepJog)
    rig.now += 301 * MS
    assert len(struck(rig, key)) == 1


@pytest.mark.virtual_clock
@pytest.mark.parametrize(("age", "presses"), [(0.24, 1), (0.26, 0), (0.29, 0)])
async def test_a_held_key_waits_for_no_state_and_moves_on_none_that_comes_later(
    age: float, presses: int, server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    panel = Panel()
    performer = Performer(pendant, panel)
    server.mutes = True
    await asyncio.sleep(age)
    performer.perform([do.PulseJog(do.JOINTS, ((0, 1),), 0.25)])
    await asyncio.sleep(0.005)
    server.mutes = False
    await asyncio.sleep(0.2)
    assert len(server.all(messages.JogStart)) == presses
    assert panel.messages.newest.startswith("STALE") == (not presses)
    await performer.close()


@pytest.mark.virtual_clock
async def test_a_press_that_nobody_beats_is_not_taken_back_where_its_verdict_is_late(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    panel = Panel()
    performer = Performer(pendant, panel)
    server.mutes = True
    performer.perform([do.PulseJog(do.JOINTS, ((0, 1),), 0.25)])
    await asyncio.sleep(0.02)
    server.mutes = False
    server.take(server.lines[-1], server.one(messages.JogStart))
    await asyncio.sleep(0.02)
    assert server.all(messages.JogRelease) == server.all(messages.JogBeat) == []
    assert panel.messages.lines == ()
    await performer.close()
