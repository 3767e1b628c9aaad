"""Pendant endpoint: the conversation with pendant apps, as a pure core.

Owns the order in which a message is examined (hello said, known, permitted), the one table from the
class of a request to who answers it, and the verdicts of what was refused. What a request means is
the business of whoever answers it, and what may move when is the cell's.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from openpendant.simplemsg import (
    Arrival,
    CommType,
    HeaderOnly,
    Malformed,
    Message,
    Overtaken,
    Received,
    ReplyCode,
    Unasked,
    WaitingStop,
    refused,
)
from openpendant.simplemsg.pendant import (
    PENDANT_MESSAGES,
    PROTOCOL_VERSION,
    Authority,
    AuthorityBeat,
    AuthorityReason,
    Capability,
    Declare,
    Enabling,
    Execute,
    Forwarded,
    Hello,
    Home,
    JogBeat,
    JogRelease,
    JogStart,
    JogStep,
    JogUndo,
    JointMove,
    JointPath,
    Lobby,
    LobbyReply,
    Login,
    Management,
    MotionControl,
    Outcome,
    Pairing,
    PoseMove,
    PosePath,
    Prepare,
    ProgramRun,
    ResetStop,
    SetAccount,
    SetMode,
    SetSpeed,
    SoftwareStop,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.pendant.management.declaration import Request
from openpendant.simplemsg.standard import Ping
from openpendant.simplemsg.verdicts import VerdictCode, in_version_2

from ...access.request_gate import is_overtaken
from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...control import Holder
from ...environment import CellEnvironment
from ...events.effects import Close, Effect, Send, Then
from ...events.management_requests import (
    MOST_ANSWER,
    MOST_BEFORE_LOGIN,
    is_known,
    parse,
    takes_long,
)
from ...events.pending import Pending
from ...events.replies import in_words, sent_away, verdict
from ...plans.plan_service import PlanService
from ...plans.plan_space import PlanSpace
from ...positions.position_book import PositionBook
from ...programs.execution.program_run import BareEnvironment
from ...programs.program_service import ProgramService
from ...refusal import Refusal
from ...scene.imports import read_apart
from ...settings.cell_settings import CellSettings
from .access_requests import ALWAYS, AccessRequests, CoreAccess, Greeting, Identity
from .catalogue_requests import CatalogueRequests
from .control_requests import AuthorityRequests, ControlRequests
from .controller_requests import ControllerRequests, offered
from .declarations import Declarations
from .document_notices import DocumentNotices
from .jog_requests import EscapeRequests, JogRequests
from .large_bodies import LargeBodies
from .management import ManagementRequests
from .motion_requests import PendantMotions
from .notifications import Listener, Listeners, Notifications

_NOT_IN_VERSION_2 = frozenset(kind for kind in PENDANT_MESSAGES if kind.PLACE.since > 2)

_Answered = Refusal | None | list[Effect]
"""Why a request is refused; None where it is done; else all that is to be written because of it,
with a verdict among it where none comes with a cell event."""

_Request = Callable[[int, Any, int], _Answered]
"""Answers a request of a session at a time [ns]."""

_IN_WORDS = frozenset({Verdict, Outcome})
"""Messages whose text may name a joint, and whose code may be a newer one."""

_Topic = Callable[[int, Any, int], list[Effect] | None]
"""Takes a message that has no answer, of a session at a time [ns]; returns what follows."""


class PendantEndpoint:
    """All pendant connections of a cell."""

    def __init__(
        self,
        cell: RobotCell,
        settings: CellSettings,
        identity: Identity,
        robot: RobotModel,
        pending: Pending,
        access: CoreAccess,
        environment: CellEnvironment | None,
        is_read_apart: Callable[[int], bool],
        plan_space: PlanSpace,
        positions: PositionBook,
    ) -> None:
        """Make an endpoint that nobody is connected to.

        Args:
            plan_space: room for the plans of all cells.
            is_read_apart: whether a large body of a session is read in a planning process.
        """
        self._is_read_apart = is_read_apart
        self._bodies = LargeBodies(pending, cell.motions.new_job_id)
        self.access = AccessRequests(
            *(access, identity, self.regranted, pending, cell.modes.enabling_deadline),
            has_tls=settings.tls.is_on,
        )
        self._cell = cell
        self._listeners = listeners = Listeners(settings, self.access.waits)
        offers = Capability(0) if environment is None else environment.capabilities
        self.controller = ControllerRequests(cell, settings, listeners)
        self._greeting = Greeting(
            identity,
            cell.limits.dof,
            settings,
            listeners,
            self.access,
            offered(cell.declaration, ALWAYS | offers),
        )
        self._declarations = Declarations(cell, listeners, self.access)
        self._kinematics = None if environment is None else environment.kinematics
        self._shapes = None if environment is None else environment.shapes
        self._positions = positions
        self._motions = PendantMotions(cell, robot, positions)
        self._jogs = JogRequests(cell, settings.jog, robot, listeners.older)
        self.programs = ProgramService(
            cell,
            robot,
            pending,
            listeners.to_all,
            cell_name=identity.cell,
            robot_name=identity.robot,
            environment=BareEnvironment() if environment is None else environment,
            keep_preview=lambda *about: self.plans.keep_preview(*about),
        )
        self._authority = AuthorityRequests(cell, listeners)
        self._control = ControlRequests(
            *(cell, listeners, self._jogs, self.programs.executor),
            None if environment is None else environment.recordings,
        )
        escapes = EscapeRequests(cell, robot, self._jogs)
        self.announcing = Notifications(cell, robot, listeners, self._jogs.states)
        self.plans = PlanService(
            *(cell, robot, settings.controller, pending, environment, plan_space, positions),
            notify=listeners.notice,
            announce=self.announcing.on_cell_event,
        )
        self._management = ManagementRequests(
            *(cell, settings, listeners, self.access, self.programs, environment),
            besides=(self.plans, escapes, self.controller, CatalogueRequests()),
        )
        signals = None if environment is None else environment.signals
        world = None if environment is None else environment.world
        self.notices = DocumentNotices(listeners, signals, world, identity.cell)
        self._requests = self._request_table()
        self._topics = self._topic_table()

    def _request_table(self) -> Mapping[type[Message], _Request]:
        """Return who answers which request of a welcomed pendant."""
        motions, jogs, control = self._motions, self._jogs, self._control
        return {
            JointMove: motions.joint_move,
            JointPath: motions.joint_path,
            PoseMove: motions.pose_move,
            PosePath: motions.pose_path,
            Home: motions.home,
            Execute: self.plans.execute,
            Prepare: self.controller.prepare,
            JogStart: jogs.start,
            JogStep: jogs.step,
            JogUndo: jogs.undo,
            JogRelease: lambda session, asked, now: jogs.release(session, asked.press, now),
            SoftwareStop: control.software_stop,
            ResetStop: control.reset_stop,
            SetMode: control.set_mode,
            SetSpeed: control.set_speed,
            MotionControl: control.motion_control,
            Authority: self._authority.authority,
            ProgramRun: self._run_program,
            Subscribe: self._greeting.subscribe,
            Declare: self._declarations.declare,
            Lobby: self._lobby,
            Login: self.access.log_in,
            Pairing: self.access.pairing,
            SetAccount: self.access.set_account,
        }

    def _topic_table(self) -> Mapping[type[object], _Topic]:
        """Return who takes which message of a welcomed pendant that has no answer."""
        jogs, cell = self._jogs, self._cell
        return {
            JogBeat: jogs.beat,
            Enabling: lambda session, held, now: cell.enable(session, held.position, now),
            AuthorityBeat: lambda session, _, now: cell.authority.beat(session, now),
        }

    def _run_program(self, session: int, message: ProgramRun, now: int) -> _Answered:
        return self.programs.executor.start(self._listeners[session].holder, message, now)

    # Connections.

    def opened(self, session: int, address: str, now: int) -> None:
        """Take note of a new connection."""
        self._listeners.opened(session, address, now)

    def closed(self, session: int, now: int) -> list[Effect]:
        """Take note that a connection ended; what it moved is stopped."""
        self._listeners.closed(session)
        self._jogs.closed(session)
        self.programs.closed(session)
        self._cell.modes.forget(session)
        change = self._cell.authority.release(session, AuthorityReason.CONNECTION_LOST)
        out = self._cell.authority_gone(change, now) + self.plans.closed(session, now)
        if self._kinematics is not None:
            out += self._kinematics.closed(session)
        if self._shapes is not None:
            out += self._shapes.closed(session)
        return [*out, *self.access.closed(session, now), *self._bodies.closed(session)]

    def regranted(self, session: int, now: int) -> list[Effect]:
        """Follow a change of what a pendant may do; somebody else does not keep the authority."""
        listener = self._listeners[session] if session in self._listeners else None
        if listener is None or not listener.welcomed:
            return []
        listener.holder = Holder(session, self.access.name_of(session, listener.hello_name))
        # While it still looks on: the end of its authority concerns it more than anybody.
        out = self._authority.follow(listener, self.access, now)
        looked_on, fault = listener.looks_on, self.access.look_on_fault(session)
        listener.looks_on = fault is None
        if looked_on and fault is not None:
            out.append(Send(session, sent_away(fault)))
        return out

    def skipped(self, session: int) -> None:
        """Count a state message that a connection was too slow for."""
        if session in self._listeners:
            self._listeners[session].dropped += 1

    def as_told(self, effects: list[Effect]) -> list[Effect]:
        """Put what leaves in the words of who gets it: codes that he knows, joints by their names.

        Connections of version 2 are told codes that they know, each with its true text.
        """
        told = effects
        for place, each in enumerate(effects):
            # Few effects have words, and each packet comes by here.
            if isinstance(each, Then) or (
                isinstance(each, Send) and type(each.message) in _IN_WORDS
            ):
                if told is effects:
                    told = effects.copy()
                told[place] = self._as_told(each)
        return told

    def _as_told(self, effect: Effect) -> Effect:
        match effect:
            case Send(session=session, message=Verdict() | Outcome() as told) if told.code:
                is_older = session in self._listeners.older
                code = in_version_2(told.code) if is_older else told.code
                text = in_words(told.text, self._cell.joint_names.in_full)
                if (code, text) != (told.code, told.text):
                    return Send(session, replace(told, code=code, text=text))
            case Then(step=step):
                return Then(lambda: self.as_told(step()))
        return effect

    # Messages.

    def may_stop(self, session: int) -> bool:
        """Return True if a pendant has said hello, logged in or not."""
        return self._listeners[session].welcomed

    def stop_first(self, session: int, stop: Message, now: int) -> list[Effect]:
        """Obey a stop before what came in front of it, and answer it first."""
        assert isinstance(stop, SoftwareStop)
        if session in self._bodies.under_way:
            self._bodies.stopped(session)
        return self._control.software_stop(session, stop, now)

    def receive(self, session: int, received: Arrival, now: int) -> list[Effect]:
        """Take one message of a pendant and return what follows from it."""
        listener = self._listeners[session]
        if listener.leaving:
            return []
        listener.heard = now
        if isinstance(received, Unasked):
            return []
        take = self._topics.get(type(received))
        if (
            take is not None
            and isinstance(received, Message)
            and received.comm_type == CommType.TOPIC
        ):
            return (take(session, received, now) if listener.welcomed else None) or []
        if isinstance(received, Malformed):
            return self._malformed(listener, received, now)
        if isinstance(received, SoftwareStop) and listener.welcomed:
            # Obeyed as a topic too: better a stop without an answer than none.
            if session in self._bodies.under_way:
                self._bodies.stopped(session)
            return self._control.software_stop(session, received, now)
        if isinstance(received, Overtaken):
            return self._overtaken(listener, received.received, now)
        if isinstance(received, WaitingStop):
            return self._stop_in_its_place(listener, received, now)
        is_request = received.comm_type == CommType.REQUEST
        return self._request(listener, received, now) if is_request else []

    def _overtaken(self, listener: Listener, received: Received, now: int) -> list[Effect]:
        """Refuse what would undo the stop that has overtaken it; take anything else as usual."""
        if (
            not isinstance(received, Message)
            or received.comm_type != CommType.REQUEST
            or not listener.welcomed
        ):
            return self.receive(listener.session, received, now)
        if isinstance(received, Management):
            return self._managed(listener.session, received, now, is_behind=False)
        if not is_overtaken(received):
            return self.receive(listener.session, received, now)
        return self._too_late(listener.session, received, "", now)

    def _too_late(self, session: int, message: Message, operation: str, now: int) -> list[Effect]:
        """Refuse a request that would undo the stop that has overtaken it."""
        # Through the gate all the same, which uses its id up: nobody can send it once more.
        refusal = self.access.gate.overtaken(session, message, operation, now)
        return self._forbidden(session, message, refusal)

    def _stop_in_its_place(self, listener: Listener, stop: WaitingStop, now: int) -> list[Effect]:
        """Answer a stop that has acted already, where it was not answered then."""
        if not stop.acted:
            return self.receive(listener.session, stop.message, now)
        if stop.answered or not stop.is_request:
            return []
        return [_verdict(listener.session, stop.message, None)]

    def _malformed(self, listener: Listener, received: Malformed, now: int) -> list[Effect]:
        out: list[Effect] = []
        if received.comm_type == CommType.REQUEST:
            if received.msg_type == Forwarded.PLACE.msg_type:
                return self._forwarded(listener, now)
            refusal = Refusal(VerdictCode.MALFORMED, str(received.error))
            out.append(Send(listener.session, verdict(received.request_id, refusal)))
        return out + listener.count_fault(now)

    def _request(self, listener: Listener, message: Message, now: int) -> list[Effect]:
        """Answer any request: the one place that lets in, counts, refuses and accepts."""
        session = listener.session
        match message:
            case Hello():
                return self._hello(listener, message, now)
            case Ping():
                return [Send(session, Ping(comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS))]
            case Forwarded():
                return self._forwarded(listener, now)
            case Lobby() if not listener.welcomed:  # and so of no version yet
                told = self._lobby(session, message, now)
                return [_verdict(session, message, told)] if isinstance(told, Refusal) else told
        if not listener.welcomed:
            return [_verdict(session, message, Refusal(VerdictCode.HELLO_FIRST))]
        if isinstance(message, Management):
            return self._managed(session, message, now)
        if listener.version < PROTOCOL_VERSION and type(message) in _NOT_IN_VERSION_2:
            return [Send(session, refused(message)), *listener.count_fault(now)]
        refusal = self.access.gate.refusal(session, message, now)
        if refusal is not None:
            return self._forbidden(session, message, refusal)
        answer = self._requests.get(type(message))
        if answer is None:
            return [Send(session, refused(message)), *listener.count_fault(now)]
        answered = self.controller.unable(message) or answer(session, message, now)
        if isinstance(answered, Refusal):
            self.access.gate.turned_down(session, message, answered, now)
        return answered if isinstance(answered, list) else [_verdict(session, message, answered)]

    def _forwarded(self, listener: Listener, now: int) -> list[Effect]:
        """Part with whoever says for whom it speaks, where nobody is believed any more."""
        refusal = self.access.forward_refused(listener.session, listener.address, now)
        listener.leaving = True
        told = HeaderOnly(Forwarded.PLACE.msg_type, reply_code=ReplyCode.FAILURE)
        return [Send(listener.session, told), Close(listener.session, refusal.sentence)]

    def _lobby(self, session: int, message: Lobby, now: int) -> Refusal | list[Effect]:
        """Tell which cells there are."""
        listener = self._listeners[session]
        refusal = self.access.lobby.rate_fault(session, now)
        if refusal is not None:
            return refusal
        listener.lobby_at = now
        told = self.access.cells_for(session, listener.address)
        body = json.dumps(told, ensure_ascii=False, separators=(",", ":")).encode()
        if len(body) > MOST_ANSWER:
            text = f"the answer has {len(body)} bytes; accepted by a frame: {MOST_ANSWER}"
            return Refusal(VerdictCode.TOO_LARGE, text, value=len(body), limit=MOST_ANSWER)
        return [Send(session, LobbyReply(message.request_id, body))]

    def _hello(self, listener: Listener, message: Hello, now: int) -> list[Effect]:
        """Greet a pendant; one that knows of named positions has them read."""
        out = self._greeting.hello(listener.session, message, now)
        is_new = listener.welcomed and listener.version == PROTOCOL_VERSION
        return out + self._positions.read_once() if is_new else out

    def _managed(
        self, session: int, message: Management, now: int, *, is_behind: bool = True
    ) -> list[Effect]:
        """Answer a management request, whose body is parsed here and only here, or elsewhere.

        Args:
            is_behind: whether it came behind all stops of its connection that have acted.
        """
        size, version = len(message.body), self._listeners[session].version
        if size > MOST_BEFORE_LOGIN:
            refusal = self.access.gate.unread(session, size, MOST_BEFORE_LOGIN, now)
            if refusal is not None:
                return self._forbidden(session, message, refusal)
        # Before a login no planning process works for anybody, and what is asked is refused.
        is_for_later = takes_long(message.body) and self.access.gate.is_let_in(session)
        if is_for_later and self._is_read_apart(session):
            then = partial(self._asked, session, message)
            newest = version == PROTOCOL_VERSION
            read = read_apart if newest else partial(read_apart, version=version)
            return self._bodies.read(session, message, read, then, is_overtaken=not is_behind)
        operation, asked = parse(message.body, version)
        return self._asked(session, message, operation, asked, not is_behind, now)

    def _asked(
        self,
        session: int,
        message: Management,
        operation: str,
        asked: Request[Any] | Refusal,
        has_stopped: bool,
        now: int,
    ) -> list[Effect]:
        """Let in and answer a request that was read, perhaps a while after it came.

        Args:
            has_stopped: whether a stop has overtaken it.
        """
        # Of a newer version: to the gate a name that this connection cannot know is none.
        known = operation if is_known(operation, self._listeners[session].version) else ""
        if has_stopped and (
            is_overtaken(message, known) or self._management.changes_tool_or_load(asked)
        ):
            return self._too_late(session, message, known, now)
        refusal = self.access.gate.operation_refusal(session, message, known, now)
        if refusal is not None:
            return self._forbidden(session, message, refusal)
        return self._management.answer(session, message, operation, asked, now)

    def _forbidden(self, session: int, message: Message, refusal: Refusal) -> list[Effect]:
        """Refuse a request to a pendant that may not make it, in the form of its answer."""
        if isinstance(message, Management):
            return self._management.reply_to(session, message).refuse(refusal)
        return [_verdict(session, message, refusal)]

    # Time.

    def tick(self, now: int) -> list[Effect]:
        """Send state to whoever is due; end conversations that never began or fell silent."""
        out = self.programs.executor.tick(now)
        if self.plans.live or self.plans.untold:
            out = out + self.plans.tick(now)
        ends, due = self._listeners.tick(now)
        return out + ends + self.notices.tick(now) + self.announcing.state(due, now)


def _verdict(session: int, message: Message, refusal: Refusal | None) -> Send:
    return Send(session, verdict(getattr(message, "request_id", 0), refusal))
