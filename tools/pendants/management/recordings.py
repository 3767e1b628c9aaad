"""Continuous recordings of a motion: begun, ended, cut, and played back at another speed."""

from __future__ import annotations

from openpendant.simplemsg.pendant.management import recordings

from .calls import call, calls_of


@calls_of("recordings")
class RecordingCalls:
    """The operations on recordings; `play` moves the robot and is the clients' own."""

    list = call(recordings.ListRecordings)
    describe = call(recordings.DescribeRecording)
    start = call(recordings.StartRecording)
    stop = call(recordings.StopRecording)
    trim = call(recordings.TrimRecordingPart)
    rename = call(recordings.RenameARecording)
    delete = call(recordings.DeleteRecording)
