"""Stored programs: taught, edited, taken back, tried without moving."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import programs

from .calls import call, calls_of


@calls_of("programs")
class ProgramCalls:
    """The operations on stored programs."""

    list = call(programs.ListPrograms)
    create = call(programs.CreateProgram)
    load = call(programs.LoadProgram)
    history = call(programs.ProgramHistory)
    save = call(programs.SaveProgram)
    check = call(programs.CheckProgram)
    delete = call(programs.DeleteProgram)
    rename = call(programs.RenameProgram)
    edit = call(programs.EditProgram)
    record = call(programs.RecordPoint)
    touch_up = call(programs.TouchUpPoint)
    undo = call(programs.UndoEdit)
    redo = call(programs.RedoEdit)
    breakpoints = call(programs.SetBreakpoints)
    dry_run = call(programs.StartDryRun)
    dry_run_progress = call(programs.AskDryRunProgress)
