"""Messages about plans: one is executed as it was shown, and what becomes of each is told."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Real, Text, Topic
from ..verdicts import VerdictCode
from .places import from_server, to_server


class PlanState(IntEnum):
    """What has become of a plan; from DONE on it can be neither read nor executed any more."""

    PLANNING = 1
    READY = 2
    RUNNING = 3
    DONE = 4
    STALE = 5
    EXPIRED = 6
    DROPPED = 7


class PlanStage(IntEnum):
    """How far a plan around obstacles has come."""

    NONE = 0
    SEARCHING = 1
    SHORTENING = 2
    CHECKING = 3


@to_server(65053, "execute", "Executes a plan, sample by sample, as it was shown.", since=3)
class Execute(Message):
    """EXECUTE: refused as stale where anything that the plan was made from has changed since."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    plan: Annotated[int, Int("number of the plan")]
    override_is_one: Annotated[int, Int("1 to be refused unless the speed override is 1, else 0")]


@from_server(65054, "plan_changed", "A plan is being made, or has changed its state.", since=3)
class PlanChanged(Topic):
    """PLAN_CHANGED: to connections of the cell that have declared that they want notices."""

    plan: Annotated[int, Int("number of the plan")]
    state: Annotated[int, Int("what has become of it", values=PlanState)]
    code: Annotated[int, Int("why, an entry of the catalogue; 0 for nothing", values=VerdictCode)]
    stage: Annotated[int, Int("how far the planning has come", values=PlanStage)]
    fraction: Annotated[float, Real("of the time that planning may take, 0 to 1")]
    text: Annotated[str, Text("one sentence, empty for none", size=96)]
