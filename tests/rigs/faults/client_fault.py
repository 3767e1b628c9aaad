"""What a scripted client can do wrong."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from openpendant.simplemsg import ByteOrder, Message
from openpendant.tools.packets.conformance.client.setup import Mutation


class Form(Enum):
    """Which points the client sends."""

    FULL = "type 14"
    SIMPLE = "type 11, streamed"
    DOWNLOAD = "type 11, downloaded"
    MOTOMAN = "type 14 to a Motoman controller"
    GROUPS = "type 2016 to a Motoman controller"

    @property
    def is_motoman(self) -> bool:
        return self in (Form.MOTOMAN, Form.GROUPS)


Neglect = Enum(
    "Neglect",
    "WAIT_FOR_REPLY REFUSAL REPLY_TYPE REPLY_CODE PATIENCE ANSWERING E_STOP MOTION_POSSIBLE "
    "SILENCE STATE_LOST FIRST_REPORT UNANSWERED_POINT ORDER_AFTER_RECONNECT RESTART ONE_LINK "
    "CALM STOP_BEFORE_LEAVING STOP_ENDS READY_QUESTION READY_ANSWER BUSY_POINT BUSY_PAUSE "
    "READY_AFTER_STOP SURVIVING NEW_BEGINNING WHOLE_FRAME POWER HEADER",
)
"""What a client can fail to do."""

Change = Callable[[Message], Message]
Cut = Callable[[bytes], list[bytes]]


@dataclass(frozen=True)
class Fault:
    """One rule that a client breaks.

    Attributes:
        check: number of the check that has to find it.
        mutation: scenario in which it shows.
        point: changes a point's message before it is sent.
        reply: changes an answer to the controller.
        cut: changes the bytes of a point.
        extra: what it sends besides, once, on the motion link.
        extra_state: what it sends besides, once, on the state link.
        neglects: what it fails to do.
        stops_at: index of the point at which it stops and closes, as a user would.
        at: index of the point that is changed, None for all.
        is_habit: a known program has it, so that it is named and does not fail.
    """

    name: str
    check: str
    mutation: Mutation = Mutation.NONE
    form: Form = Form.FULL
    point: Change | None = None
    stop: Change | None = None
    reply: Change | None = None
    cut: Cut | None = None
    cut_reply: Cut | None = None
    extra: Message | bytes | None = None
    extra_state: Message | bytes | None = None
    neglects: Neglect | None = None
    stops_at: int | None = None
    at: int | None = 5
    order: ByteOrder = ByteOrder.LITTLE
    is_habit: bool = False
