"""Signals of the controller, the robot itself, and the trace of its tool."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import robots, signals, trace

from .calls import call, calls_of


@calls_of("signals")
class SignalCalls:
    """The operations on signals."""

    read = call(signals.ReadAllSignals)
    set = call(signals.SetSignal)


@calls_of("robots")
class RobotCalls:
    """The operations on the robot itself."""

    list = call(robots.ListRobots)
    describe = call(robots.DescribeRobot)
    load = call(robots.LoadRobot)


@calls_of("trace")
class TraceCalls:
    """The operations on the trace of the tool."""

    show = call(trace.ShowTrace)
    clear = call(trace.ClearTrace)
