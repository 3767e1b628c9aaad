"""Tools: their centre points in the flange, which one is selected, and calibration."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import tools

from .calls import call, calls_of


@calls_of("tools")
class ToolCalls:
    """The operations on tools."""

    add = call(tools.AddTool)
    move = call(tools.MoveTool)
    remove = call(tools.RemoveTool)
    select = call(tools.SelectTool)
    calibrate = call(tools.CalibrateTool)
    import_ = call(tools.ImportTools)
