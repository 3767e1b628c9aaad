"""One connection to a pendant server: hello, login, requests and notifications.

Owns the connection from connect to close. Knows nothing of motion; `observing`, `operating` and
`jog` are built on it, and `client` joins them.
"""

from __future__ import annotations

import asyncio
import ssl
import warnings
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self, TypeVar, cast

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    AuthorityChanged,
    AuthorityWanted,
    Capability,
    ControllerChanged,
    Declare,
    DocumentChanged,
    Hello,
    HelloReply,
    JogEnded,
    Lobby,
    LobbyReply,
    Login,
    LoginKind,
    ModeChanged,
    Notices,
    Outcome,
    PlanChanged,
    ProgramReport,
    State,
    StopChanged,
    Verdict,
)
from openpendant.simplemsg.pendant.management.cell import ServedCells

from .connection_errors import (
    DEFAULT_PORT,
    WITH_TLS,
    ConnectionLost,
    NotUnderstood,
    PendantError,
    Refused,
    SecretUnprotected,
    SecretUnprotectedWarning,
    WrongArgument,
    answer_of,
    check_port,
    judged,
    unanswered,
    unreachable,
)
from .conversation import HELLO, Conversation, keep_alive
from .motions import MotionHandle

_HELLO_WITHIN = 10.0
"""Time for the hello reply [s]; a server that needs longer is taken for no pendant server."""

SHORTEST_SILENCE, LONGEST_SILENCE = 0.05, 0.25
"""Bounds of the silence of an enabling device that may be declared [s]."""

_LOGIN_WITHIN = 180.0
"""Time for the answer to a login [s]: it waits for its turn behind those of others, for a minute
where a whole building logs in at once, and longer behind an address from which somebody guesses."""

_TLS_WITHIN = 10.0
"""Likewise, who begins no TLS [s]."""

_CLOSE_WITHIN = 2.0
"""Time for the pending bytes on close, on a link that may be dead [s]."""

_Notification = TypeVar("_Notification", bound=Message)


class PendantSession:
    """One connection to a pendant server.

    The callbacks run on the event loop, so they must not block; what they raise goes to the loop's
    exception handler, and the connection goes on.

    Attributes:
        hello: the server's hello reply.
        state: the newest state message, None before the first.
        on_state: called with every state message.
        on_authority: called when the owner of the motion authority changes.
        on_wanted: called when another pendant requests the authority that we hold.
        on_stop: called when a stop is latched or reset.
        on_mode: called when the mode of operation changes.
        on_plan: called when a plan changes its state, where notices were declared to be wanted.
        on_program: called when a program comes to another line, pauses or ends.
        ramp_time: how long the robot may take to come to rest after a press ended [s]; then it is
            stopped. None until the server has said it.
        on_document: called when a document changes, where the wish was declared.
        on_controller: called when something else is known of the controller; ask
            `controller.describe` again.
    """

    hello: HelloReply

    _version = PROTOCOL_VERSION

    def __init__(self) -> None:
        self.state: State | None = None
        self.on_state: Callable[[State], None] | None = None
        self.on_authority: Callable[[AuthorityChanged], None] | None = None
        self.on_wanted: Callable[[AuthorityWanted], None] | None = None
        self.on_stop: Callable[[StopChanged], None] | None = None
        self.on_mode: Callable[[ModeChanged], None] | None = None
        self.on_plan: Callable[[PlanChanged], None] | None = None
        self.on_program: Callable[[ProgramReport], None] | None = None
        self.on_document: Callable[[DocumentChanged], None] | None = None
        self.on_controller: Callable[[ControllerChanged], None] | None = None
        self._conversation = Conversation(self._take_notification)
        self._client = ""
        self._state_rate = 0.0
        self._is_strict = False
        self._keeping: asyncio.Task[None] | None = None
        self.ramp_time: float | None = None
        self._logged_in: float | None = None
        """Time of the last granted login, by the loop's clock [s]; None without one."""
        self._away: Refused | None = None
        """Why no state comes until we have logged in again."""

    @classmethod
    async def connect(
        cls,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        client: str = "pendant",
        cell: str = "",
        state_rate: float = 25.0,
        tls: ssl.SSLContext | None = None,
        strict: bool = False,
        user: str = "",
        password: str | None = None,
        pairing: str | None = None,
        enabling_deadline: float = LONGEST_SILENCE,
        notices: bool = False,
        language: str = "",
    ) -> Self:
        """Connect, say hello and, where a secret is given, log in.

        Args:
            host: address of the server.
            port: its pendant port.
            client: name of this pendant, shown to others; at most 32 bytes.
            cell: name of the cell, empty for the only one.
            state_rate: state messages wanted, Hz; 0 for none, which also rules out jogs.
            tls: how to encrypt and whom to trust; None for an unencrypted connection.
            strict: send no password and no pairing code to another machine where others can read
                it on its way, without TLS or with a certificate that nobody verified; otherwise
                `SecretUnprotectedWarning` says so before it leaves.
            user: account, or with a pairing code the name of a guest, which no account and no
                other guest has; a guest who gives none is called as `client`.
            password: of the account.
            pairing: code that the teacher shows, instead of a password.
            enabling_deadline: the enabling device (training) counts as let go after so long a
                silence, 0.05 to 0.25 s; 0 for the cell's own. No press may be silent for longer.
            notices: be told what others change: `on_document`, `on_plan`.
            language: of the person, as `en`; at most 8 bytes, for the server's audit log.

        Raises:
            Unreachable: nobody listens there, or it does not speak TLS; an OSError, too.
            NotTrusted: the same, where the certificate is not trusted.
            Refused: the server refuses the connection.
            ConnectionLost: the connection ended before the hello was answered.
            WrongArgument: a text is too long, host or port is none, or both password and pairing
                code are given.
            SecretUnprotected: the secret would leave in clear text, and this is `strict`.
        """
        pendant = cls()
        pendant._is_strict = strict
        encrypted = tls is not None
        await pendant._open(host, port, tls)
        try:
            try:
                await pendant._say_hello(client, cell, state_rate)
            except ConnectionLost as error:
                raise unanswered(error, host, port, tls=encrypted) from None
            if pendant._version >= Declare.PLACE.since:
                pendant._declare_at_once(enabling_deadline, notices, language)
            if password is not None or pairing is not None:
                await pendant.login(user, password=password, pairing=pairing)
        except BaseException:
            await pendant.close()
            raise
        return pendant

    @classmethod
    async def lobby(
        cls,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        tls: ssl.SSLContext | None = None,
    ) -> ServedCells:
        """Return which cells a server has, without a hello or a login: to choose one by.

        Who holds a cell and whether it moves is told where this machine may look on without a
        login. On an open connection `cells` returns the same.

        Args:
            host: address of the server.
            port: its pendant port.
            tls: how to encrypt and whom to trust; None for an unencrypted connection.

        Raises:
            Unreachable: nobody listens there, or it does not speak TLS; an OSError, too.
            NotTrusted: the same, where the certificate is not trusted.
            Refused: HELLO_FIRST of a server that has no lobby; NO_PLACE.
            ConnectionLost: the connection ended before there was an answer.
            NotUnderstood: the answer is no lobby.
            WrongArgument: host or port is none.
        """
        visitor = cls()
        await visitor._open(host, port, tls)
        try:
            async with asyncio.timeout(_HELLO_WITHIN):
                reply = await visitor._ask(lambda request_id: Lobby(request_id=request_id))
        except TimeoutError:
            lost = ConnectionLost(f"nothing within {_HELLO_WITHIN:g} s")
            raise unanswered(lost, host, port, tls=tls is not None) from None
        except ConnectionLost as error:
            raise unanswered(error, host, port, tls=tls is not None) from None
        finally:
            await visitor.close()
        if not isinstance(reply, LobbyReply):
            raise ConnectionLost(f"the server answered with {reply}")
        told = answer_of(reply)
        cells = told.get("cells")
        if not isinstance(cells, list) or not all(map(_is_cell, cells)):
            raise NotUnderstood("the server's lobby has no list of cells; is it a pendant server?")
        return cast(ServedCells, told)

    async def _open(self, host: str, port: int, tls: ssl.SSLContext | None) -> None:
        check_port(port)
        try:
            await asyncio.get_running_loop().create_connection(
                lambda: self._conversation,
                host,
                port,
                ssl=tls,
                server_hostname=None if tls is None else host,
                ssl_handshake_timeout=None if tls is None else _TLS_WITHIN,
            )
        except OSError as error:
            raise unreachable(error, host, port, tls=tls is not None) from None
        except ValueError as error:
            raise WrongArgument(f"{host!r} is no host: {error}") from None

    def _begin_work(self) -> None:
        """Set up the parts that need the hello reply."""
        self._keeping = asyncio.get_running_loop().create_task(
            keep_alive(self._conversation, self._misses_states)
        )

    async def _say_hello(self, client: str, cell: str, state_rate: float) -> None:
        hello = Hello(
            protocol_version=self._version, state_rate=state_rate, cell=cell, client=client
        )
        try:
            async with asyncio.timeout(_HELLO_WITHIN):
                reply = await self._conversation.ask(hello, HELLO)
        except TimeoutError:
            raise ConnectionLost(f"nothing within {_HELLO_WITHIN:g} s") from None
        if not isinstance(reply, HelloReply):
            raise ConnectionLost(f"the server answered hello with {reply}")
        self.hello = reply
        self._client = client
        self._state_rate = state_rate
        self._begin_work()

    async def declare(
        self,
        *,
        enabling_deadline: float = LONGEST_SILENCE,
        notices: bool = False,
        language: str = "",
    ) -> float:
        """Declare anew what `connect` declared; not while this connection moves the robot.

        Args:
            enabling_deadline: the enabling device (training) counts as let go after so long a
                silence, 0.05 to 0.25 s; 0 for the cell's own. No press may be silent for longer.
            notices: be told what others change: `on_document`, `on_plan`.
            language: of the person, as `en`; at most 8 bytes, for the server's audit log.

        Returns:
            How long the robot may take to come to rest after a press ended [s].

        Raises:
            WrongArgument: the deadline is out of bounds, or the language too long.
            Refused: MOVING, this connection moves the robot.
            ConnectionLost: the connection ended.
        """
        request_id = self._conversation.new_request()
        request = _declaration(request_id, enabling_deadline, notices, language)
        return self._declared(await self._conversation.ask(request, request_id))

    def _declare_at_once(self, enabling_deadline: float, notices: bool, language: str) -> None:
        """Declare without a wait for the answer: a stop may be urgent."""
        request_id = self._conversation.new_request()
        request = _declaration(request_id, enabling_deadline, notices, language)
        answer = self._conversation.send(request, request_id)
        answer.add_done_callback(self._take_ramp_time)

    def _take_ramp_time(self, answer: asyncio.Future[Message]) -> None:
        if answer.cancelled() or answer.exception() is not None:
            return  # the connection ended
        try:
            self._declared(judged(answer, None))
        except PendantError as error:
            text = f"the server does not take what was declared: {error}"
            context = {"message": text, "exception": error}
            asyncio.get_running_loop().call_exception_handler(context)

    def _declared(self, answer: Message) -> float:
        if not isinstance(answer, Verdict):
            raise NotUnderstood(f"the server answered with {answer}")
        self.ramp_time = answer.value
        return answer.value

    def _enabling_sign(self) -> Sequence[Message]:
        """Return what goes in front of a press or a beat; overridden by who has the device."""
        return ()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()

    async def close(self) -> None:
        """End the connection; what it was moving is stopped by the server."""
        await end_task(self._keeping)
        self._conversation.close()
        try:
            async with asyncio.timeout(_CLOSE_WITHIN):
                await self._conversation.closed.wait()
        except TimeoutError:
            self._conversation.abort()
            await self._conversation.closed.wait()

    def abort(self) -> None:
        """Break the connection at once, as a program that dies would."""
        self._conversation.abort()

    async def login(
        self, user: str, *, password: str | None = None, pairing: str | None = None
    ) -> None:
        """Log in with an account or as a guest; a stop never needs it.

        Args:
            user: account, or name of a guest; a guest whose name is empty is called as the client.
            password: of the account.
            pairing: code that the teacher shows, instead of a password.

        Raises:
            Refused: name, password or code is wrong, or there were too many attempts.
            WrongArgument: not exactly one of password and pairing code is given.
            SecretUnprotected: others could read the secret, and the connection is `strict`.
            ConnectionLost: the connection ended.
        """
        if (password is None) == (pairing is None):
            raise WrongArgument("give either a password or a pairing code")
        kind = LoginKind.PASSWORD if pairing is None else LoginKind.PAIRING
        secret = password if pairing is None else pairing
        self._guard_secret("a password" if pairing is None else "a pairing code")
        request_id = self._conversation.new_request()
        name = user if pairing is None else user or self._client
        request = Login(request_id=request_id, kind=kind, name=name, secret=secret or "")
        await self._conversation.ask(request, request_id, within=_LOGIN_WITHIN)
        self._logged_in = asyncio.get_running_loop().time()
        self._away = None

    def _guard_secret(self, what: str) -> None:
        """Warn before a secret leaves where others can read it; refuse where this is strict.

        Raises:
            SecretUnprotected: it does, and this is strict.
        """
        why = self._conversation.unprotected
        if not why:
            return
        text = f"{what} leaves {why}"
        if self._is_strict:
            raise SecretUnprotected(
                f"not sent: {text}; trust the server's certificate ({WITH_TLS})"
            )
        warnings.warn(
            f"{text}: whoever is on the way can read it; use TLS ({WITH_TLS})",
            SecretUnprotectedWarning,
            stacklevel=2,
        )

    @property
    def is_open(self) -> bool:
        """True while no end of the connection is known."""
        return self._conversation.error is None

    def offers(self, capability: Capability) -> bool:
        """Return True if the server offers a capability to this connection."""
        return bool(self.hello.capabilities & capability)

    async def _ask(self, make: Callable[[int], Message]) -> Message:
        """Send a request that is made with a fresh request id; return its answer."""
        request_id = self._conversation.new_request()
        return await self._conversation.ask(make(request_id), request_id)

    async def _begin(self, make: Callable[[int], Message]) -> MotionHandle:
        """Send a motion request that is made with a fresh request id; return the motion."""
        request_id = self._conversation.new_request()
        _, motion = await self._conversation.begin_motion(make(request_id), request_id)
        return motion

    def _take_notification(self, message: Message) -> None:
        match message:
            case State():
                self.state = message
                self._state_came(message)
                _call_back(self.on_state, message)
            case AuthorityChanged():
                self._authority_moved(message)
                _call_back(self.on_authority, message)
            case AuthorityWanted():
                _call_back(self.on_wanted, message)
            case StopChanged():
                _call_back(self.on_stop, message)
            case ModeChanged():
                _call_back(self.on_mode, message)
            case PlanChanged():
                _call_back(self.on_plan, message)
            case ProgramReport():
                _call_back(self.on_program, message)
            case DocumentChanged():
                _call_back(self.on_document, message)
            case ControllerChanged():
                _call_back(self.on_controller, message)
            case JogEnded():
                self._jog_ended(message)
            case Outcome():
                told = message
                self._away = Refused(told.code, told.text, told.joint, told.value, told.limit)
                self._sent_away(self._away)

    def _state_came(self, state: State) -> None:
        """Take a state message; overridden by the class that owns the state."""

    def _sent_away(self, why: Refused) -> None:
        """Take that no state message will come; overridden by the class that waits for one."""

    def _misses_states(self, now: float, heard: float) -> bool:
        """Fail the waits for a state that is overdue; overridden by the class that owns the state.

        Returns:
            True to send a ping.
        """
        return False

    def _authority_moved(self, change: AuthorityChanged) -> None:
        """Take a change of the authority; overridden by the class that holds it."""

    def _jog_ended(self, account: JogEnded) -> None:
        """Take the account of an ended press; overridden by the class that presses."""


def _is_cell(told: object) -> bool:
    """Return True if this is a cell of a lobby, with its name and that of its robot."""
    return isinstance(told, dict) and all(
        isinstance(told.get(name), str) for name in ("cell", "robot")
    )


def _declaration(
    request_id: int, enabling_deadline: float, notices: bool, language: str
) -> Declare:
    if enabling_deadline and not SHORTEST_SILENCE <= enabling_deadline <= LONGEST_SILENCE:
        accepted = f"0, or {SHORTEST_SILENCE:g} to {LONGEST_SILENCE:g}"
        raise WrongArgument(f"enabling deadline {enabling_deadline:g} s; accepted: {accepted}")
    return Declare(
        request_id=request_id,
        enabling_deadline=enabling_deadline,
        notices=Notices.WANTED if notices else Notices.UNWANTED,
        language=language,
    )


def _call_back(
    callback: Callable[[_Notification], None] | None, notification: _Notification
) -> None:
    """Call a user's callback; what it raises must not break the connection."""
    if callback is None:
        return
    try:
        callback(notification)
    except Exception as error:
        text = f"a callback raised on {type(notification).__name__}"
        asyncio.get_running_loop().call_exception_handler({"message": text, "exception": error})


async def end_task(task: asyncio.Task[None] | None) -> None:
    """Cancel a task and wait until it is over."""
    if task is not None:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
