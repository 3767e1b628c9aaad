"""A job as it goes through the pipe to a planning process.

A question is the length of a pickle, the pickle, and behind it the samples of a recording, of which
the pickle tells the size. These may be tens of megabytes, so nothing here joins or copies them as a
whole on the event loop: `process` writes them a piece at a time, and the loop turns in between.
"""

from __future__ import annotations

import pickle
import struct
from collections.abc import Sequence
from dataclasses import replace
from typing import BinaryIO

from .jobs import Job
from .recording_job import RecordingJob

LENGTH = struct.Struct("<I")
"""Stands before each pickle, in both directions."""


def split_question(robot: str, job: Job) -> tuple[bytes, Sequence[bytes]]:
    """Return what is written at once, and the pieces that follow it.

    Args:
        robot: name or file of the robot that the job is for.
        job: what to plan.
    """
    pieces: Sequence[bytes] = ()
    if isinstance(job, RecordingJob):
        pieces, job = job.samples, replace(job, samples=())
    data = pickle.dumps((robot, job, sum(map(len, pieces))))
    return LENGTH.pack(len(data)) + data, pieces


def read_question(pipe: BinaryIO) -> tuple[str, Job] | None:
    """Return robot and job of the next question; None where the pipe ends before. Blocks."""
    head = pipe.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (length,) = LENGTH.unpack(head)
    data = pipe.read(length)
    if len(data) < length:
        return None
    robot, job, size = pickle.loads(data)
    samples = pipe.read(size)
    if len(samples) < size:
        return None
    if isinstance(job, RecordingJob):
        job = replace(job, samples=(samples,))
    return robot, job
