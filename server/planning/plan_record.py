"""A planner's answer as data in the server's journal, and back.

The planner is another process, so what it says comes from outside like any packet, and is noted
whole: every sample, exactly. Samples and programs are long; the journal's writer spells them out.
The certificate is not noted: reading an answer makes it anew, by the same independent check.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from openpendant.motion.certificate import certify
from openpendant.motion.errors import MotionError
from openpendant.motion.limits import JointLimits
from openpendant.motion.trajectory import Array, FineSamples, Trajectory
from openpendant.simplemsg.journal_text import Part, base64_value, with_long_texts
from openpendant.simplemsg.verdicts import VerdictCode

from ..field_fault import field_fault
from ..programs.work import RESULTS
from ..refusal import Refusal
from .jobs import DryRunFound, DryRunSlice, Planned
from .recording_job import PlaybackAccount
from .way_check_job import WayFree

_FOUND: dict[str, TypeAdapter[Any]] = {
    kind.__name__: TypeAdapter(kind) for kind in (DryRunFound, DryRunSlice, WayFree, *RESULTS)
}
_PLAYBACK = TypeAdapter(PlaybackAccount)
_ARRAYS = ("times", "position", "velocity", "acceleration", "waypoint_times")
_FINE = ("position", "velocity")


class PlanRecordError(ValueError):
    """The record holds no answer of a planner; the text says why."""


class _Refused(BaseModel):
    model_config = ConfigDict(extra="forbid")

    code: VerdictCode
    text: str
    joint: int
    value: float
    limit: float


class _Record(BaseModel):
    model_config = ConfigDict(extra="ignore")

    plan_time: float
    took: float = 0.0
    joints: int = 0
    refused: _Refused | None = None
    samples: dict[str, str] | None = None
    playback: Any = None
    kind: str | None = None
    found: Any = None


def plan_to_json(planned: Planned) -> dict[str, Any]:
    """Return an answer as data for a journal; reals keep every bit."""
    result = planned.result
    if isinstance(result, Refusal):
        refused = {name: getattr(result, name) for name in _Refused.model_fields}
        return {"plan_time": planned.plan_time, "refused": refused}
    if not isinstance(result, tuple):
        found = _FOUND[type(result).__name__].dump_python(result, mode="json")
        if isinstance(result, RESULTS):
            found = with_long_texts(found)
        return {"plan_time": planned.plan_time, "kind": type(result).__name__, "found": found}
    trajectory, _ = result
    samples = {name: _encode(getattr(trajectory, name)) for name in _ARRAYS}
    if trajectory.fine is not None:
        samples |= {f"fine_{name}": _encode(getattr(trajectory.fine, name)) for name in _FINE}
    times = {"plan_time": planned.plan_time, "took": planned.took}
    record = {**times, "joints": trajectory.dof, "samples": samples}
    if planned.playback is not None:
        record["playback"] = _PLAYBACK.dump_python(planned.playback, mode="json")
    return record


def plan_from_json(
    job_id: int, record: dict[str, Any], limits: JointLimits, start: Sequence[float]
) -> Planned:
    """Return the answer that a record holds.

    Args:
        job_id: number of the job.
        record: as `plan_to_json` made it; other keys are ignored.
        limits: what the trajectory is certified against.
        start: (n,) where the robot stood when the job was given [rad or m].

    Raises:
        PlanRecordError: the record is damaged, or its trajectory does not pass the certificate.
    """
    try:
        read = _Record.model_validate(record)
        if read.refused is not None:
            return Planned(job_id, Refusal(**read.refused.model_dump()), read.plan_time)
        if read.kind is not None:
            if read.kind not in _FOUND:
                raise PlanRecordError(f"no answer of a planner is called {read.kind!r}")
            # As text, because statements are strict: an object is a statement in JSON alone.
            found = _FOUND[read.kind].validate_json(json.dumps(read.found))
            return Planned(job_id, found, read.plan_time)
        if read.samples is None:
            raise PlanRecordError("neither a trajectory nor a refusal")
        arrays = {name: _decode(read.samples[name]) for name in _ARRAYS}
        for name in ("position", "velocity", "acceleration"):
            arrays[name] = arrays[name].reshape(-1, read.joints)
        trajectory = Trajectory(**arrays, fine=_fine(read.samples, read.joints))
        return Planned(
            job_id,
            (trajectory, certify(trajectory, limits, start=start)),
            read.plan_time,
            None if read.playback is None else _PLAYBACK.validate_python(read.playback),
            read.took,
        )
    except KeyError as error:
        raise PlanRecordError(f"no samples of {error.args[0]}") from None
    except ValidationError as error:
        raise PlanRecordError(field_fault(error)) from None
    except (ValueError, MotionError) as error:
        raise PlanRecordError(str(error)) from None


def _fine(samples: dict[str, str], joints: int) -> FineSamples | None:
    if f"fine_{_FINE[0]}" not in samples:
        return None
    return FineSamples(*(_decode(samples[f"fine_{name}"]).reshape(-1, joints) for name in _FINE))


def _encode(array: Array) -> Part:
    return base64_value(np.ascontiguousarray(array, dtype="<f8").reshape(-1).view(np.uint8).data)


def _decode(text: str) -> Array:
    return np.frombuffer(base64.b64decode(text, validate=True), dtype="<f8").astype(np.float64)
