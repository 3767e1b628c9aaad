"""Settings of one robot cell: the keys of its configuration file, with units, bounds and defaults.

Owns these keys and the names of the connections to a robot controller (`ControllerPath`). Several
cells in one file are the business of `server_settings`. Must not know how a file is read or
written: that is the business of `config_file`.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Callable
from enum import Enum
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)

from openpendant.simplemsg import ByteOrder

from .config_file import OFF, checked

EventLoop = Literal["asyncio", "uvloop"]

Port = Annotated[int, Field(ge=0, le=65_535, description="TCP port, 0 for any free one")]

_LONGEST_HOST = 253


def _check_host(host: str) -> str:
    try:
        # The system's own calls fail on such names with errors that nobody connects to a name.
        is_possible = 0 < len(host.encode("idna")) <= _LONGEST_HOST
    except UnicodeError:
        is_possible = False
    if not is_possible or not host.isprintable() or " " in host:
        raise ValueError("accepted: an address or a host name")
    return host


Host = Annotated[str, AfterValidator(_check_host)]


def _port_or_off(value: object) -> object:
    if value == OFF:
        return None
    if isinstance(value, str) and not value.removeprefix("-").isdecimal():
        raise ValueError(f"accepted: a TCP port, 0 for any free one, or {OFF}")
    return value


RosPort = Annotated[Port | None, BeforeValidator(_port_or_off)]

UNLESS_ACCOUNTS = "unless accounts"
"""Value in a file for a ROS-Industrial port of the usual number that nobody asked for."""


class UnaskedPort(int):
    """TCP port that neither a file nor an argument named.

    The ports of ROS-Industrial know no login, so that such a one is served only as long as nobody
    needs one: whoever has accounts and wants these ports as well names them.
    """


def _unless_accounts(usual: int) -> Callable[[object, ValidatorFunctionWrapHandler], Any]:
    def check(value: object, check_number: ValidatorFunctionWrapHandler) -> Any:
        is_unasked = value == UNLESS_ACCOUNTS or isinstance(value, UnaskedPort)
        return UnaskedPort(usual) if is_unasked else check_number(value)

    return check


_AS_ASKED = PlainSerializer(lambda port: UNLESS_ACCOUNTS if isinstance(port, UnaskedPort) else port)

_MOTION_PORT, _STATE_PORT = 11000, 11002

BY_CONTROLLER = "by controller"


def _seconds_or_by_controller(value: object) -> object:
    if value == BY_CONTROLLER:
        return None
    if isinstance(value, str) or value is None:
        raise ValueError(f'accepted: 0.05 to 1 s, or "{BY_CONTROLLER}"')
    return value


WatchdogDeadline = Annotated[
    Annotated[float, Field(ge=0.05, le=1.0)] | None,
    BeforeValidator(_seconds_or_by_controller),
    PlainSerializer(lambda seconds: BY_CONTROLLER if seconds is None else seconds),
]
"""A time [s], or None where it goes by what the controller says of itself."""


class SettingsTable(BaseModel):
    """A table of a configuration file: nothing unknown is taken, nothing changes later."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class AccessSettings(SettingsTable):
    """Who may look on, how long a pairing code lasts, and where the audit log is."""

    observe_without_login: bool = False
    """Whoever reaches the server may look on; otherwise only this machine may without a login."""
    pairing_minutes: Annotated[float, Field(ge=1, le=24 * 60)] = 15.0
    """How long a pairing code lasts, minutes."""
    audit_log: str = ""
    """File of the audit log, `audit.jsonl`; empty for none on loopback."""


class TlsSettings(SettingsTable):
    """The server's certificate, and whose certificates it asks for."""

    certificate: str = ""
    """File with the certificate and the ones that signed it (PEM); empty for no TLS."""
    key: str = ""
    """File with its private key (PEM, not encrypted, readable by its owner)."""
    ca: str = ""
    """File with the authorities whose client certificates are taken (PEM); empty for none asked."""

    @model_validator(mode="after")
    def _is_whole(self) -> TlsSettings:
        if bool(self.certificate) != bool(self.key):
            raise ValueError("certificate and key are given together, or neither")
        if self.ca and not self.certificate:
            raise ValueError("ca needs certificate and key")
        return self

    @property
    def is_on(self) -> bool:
        """True if connections are encrypted."""
        return bool(self.certificate)


def _check_name(name: str) -> str:
    if not (name.isprintable() and 1 <= len(name.encode("utf-8", "replace")) <= 32):
        raise ValueError("a name is 1 to 32 bytes of printable characters")
    return name


def _check_gateway_address(address: str) -> str:
    # Not through a name service: who asks that decides whose word is believed.
    try:
        ip = None if "%" in address else ipaddress.ip_address(address)
    except ValueError:
        ip = None
    if ip is None or ip.is_unspecified or ip.is_multicast:
        raise ValueError("accepted: the address of one host, not a network, a name, zone or port")
    return address


class GatewaySettings(SettingsTable):
    """A program that opens connections for browsers, and is believed whose each is."""

    name: Annotated[str, AfterValidator(_check_name)]
    """What it calls itself, at most 32 bytes; stands in the audit log."""
    address: Annotated[str, AfterValidator(_check_gateway_address)]
    """Where its connections come from; off loopback TLS is demanded."""
    secret_file: Annotated[str, Field(min_length=1)]
    """File with its secret, 32 random bytes in hexadecimal, readable by its owner only."""


def _check_gateways(gateways: tuple[GatewaySettings, ...]) -> tuple[GatewaySettings, ...]:
    if len({each.name for each in gateways}) < len(gateways):
        raise ValueError("each gateway needs a name of its own")
    return gateways


class ListenForAll(SettingsTable):
    """Where the server listens for the pendants of all cells."""

    host: Host = "127.0.0.1"
    """Address to bind; loopback unless credentials are configured."""
    pendant_port: Port = 11010
    """Pendant protocol."""
    max_connections: Annotated[int, Field(ge=1, le=1_024)] = 256
    """Connections at once, all ports together."""


class Listen(ListenForAll):
    """Where the server listens."""

    ros_motion_port: Annotated[
        RosPort, WrapValidator(_unless_accounts(_MOTION_PORT)), _AS_ASKED
    ] = UnaskedPort(_MOTION_PORT)
    """ROS-Industrial motion connections, "off" for none; 11000 "unless accounts"."""
    ros_state_port: Annotated[RosPort, WrapValidator(_unless_accounts(_STATE_PORT)), _AS_ASKED] = (
        UnaskedPort(_STATE_PORT)
    )
    """ROS-Industrial state connections, "off" for none; 11002 "unless accounts"."""


_LEAD_WITHOUT_STOP = 0.1


class ControllerLink(SettingsTable):
    """The robot controller and how to talk to it."""

    host: Host = "127.0.0.1"
    """Its address."""
    motion_port: Port = 12000
    """Its motion port."""
    state_port: Port = 12002
    """Its state port."""
    byte_order: Literal["little", "big"] = "little"
    """Its byte order; the controller's wins."""
    real_size: Literal[4, 8] = 4
    """Bytes of a real on its wire."""
    points: Literal["full", "simple"] = "full"
    """Type 14 with velocity, acceleration and time, or type 11."""
    emulated: bool = False
    """It is known to be an emulated one: together with its own word that permits what only training
    may do. Never true for a real robot."""
    signals: Literal["none", "openpendant"] = "none"
    """Its inputs and outputs: none, or by our messages, as the emulated controller has them."""
    stop_connection: bool = True
    """Keep a second motion connection for nothing but STOP."""
    points_in_flight: Annotated[int, Field(ge=1, le=8)] = 1
    """How many points may wait for their answers at once; more than 1 only where it takes them."""
    reply_deadline: Annotated[float, Field(ge=0.05, le=2.0)] = 0.5
    """A point not answered by then aborts the motion, s; no robot sets off later than that."""
    state_period: Annotated[float, Field(ge=0.001, le=0.2)] = 0.01
    """How often it reports its state, s; a robot that is not seen for four of them is stopped."""
    lead: Annotated[float, Field(ge=0.02, le=0.25)] = 0.25
    """How far points are sent ahead of the robot, s; without a connection for STOP 0.1 at most."""
    path_tolerance: Annotated[float, Field(ge=0.001, le=0.5)] = 0.02
    """A joint reported farther from its path stops the robot, rad; a sliding one half as many m."""
    lag: Annotated[float, Field(ge=0, le=0.25)] = 0.08
    """How far a joint may be behind its set-points, s; as much of its speed is accepted besides."""
    noise: Annotated[float, Field(ge=0, le=0.01)] = 0.001
    """How far a reported position may be from the true one, rad or m; accepted besides."""
    reconnect_period: Annotated[float, Field(ge=0.05, le=60)] = 0.5
    """Pause between attempts to connect, s."""

    @property
    def planned_lead(self) -> float:
        """How far the points of a planned motion are sent ahead [s].

        Where the watchdog has to connect before it can stop, what the controller has in stock is
        what the robot still does.
        """
        return self.lead if self.stop_connection else min(self.lead, _LEAD_WITHOUT_STOP)

    @property
    def order(self) -> ByteOrder:
        """The byte order as the codec names it."""
        return ByteOrder.LITTLE if self.byte_order == "little" else ByteOrder.BIG

    @property
    def fresh_age_ns(self) -> int:
        """Oldest report that a new motion may start from (promise 5 as amended)."""
        return round(1e9 * max(0.1, 2.5 * self.state_period))

    @property
    def abort_age_ns(self) -> int:
        """Age of the last report that aborts a motion (promise 5 as amended)."""
        return round(1e9 * max(0.25, 4 * self.state_period))


class RosSettings(SettingsTable):
    """The ROS-Industrial face: the server looks like a controller."""

    allow: tuple[str, ...] = ("127.0.0.1", "::1")
    """Addresses that may move the robot; others are only told its state."""
    unknown_mode_is_automatic: bool = False
    """Move although the controller does not report its mode."""
    byte_order: Literal["little", "big"] = "little"
    """State port, for addresses without a motion connection to learn it from."""
    state_rate: Annotated[float, Field(ge=1, le=125)] = 50.0
    """Joint positions and status, Hz."""
    trajectory_gap: Annotated[float, Field(ge=0.02, le=0.9)] = 0.15
    """A streamed trajectory ends when no point follows for so long after the last reply, s."""
    resume_window: Annotated[float, Field(gt=0, le=10)] = 2.0
    """How long points of a lost connection wait for it to come back, s."""
    idle_release: Annotated[float, Field(gt=0, le=60)] = 3.0
    """The authority ends after so long at rest with nothing queued, s."""
    abort_silence: Annotated[float, Field(ge=0, le=4)] = 1.5
    """After a refused or broken-off trajectory its client is told no joint positions for so long,
    s, because the stock action node ends a goal by nothing but 1 s without them; 0 for never."""
    approach_speed: Annotated[float, Field(gt=0, le=0.1)] = 0.1
    """Speed towards a first point where the robot does not stand, of the joints' limits."""
    max_points: Annotated[int, Field(ge=1, le=20_000)] = 5_000
    """Most points of one trajectory."""


class Pendants(SettingsTable):
    """The pendant face."""

    authority_timeout: Annotated[float, Field(ge=0.5, le=60)] = 3.0
    """The motion authority expires so long after its holder's last beat, s."""
    max_state_rate: Annotated[float, Field(ge=1, le=125)] = 100.0
    """Fastest state messages, Hz."""
    hello_deadline: Annotated[float, Field(ge=0.5, le=30)] = 2.0
    """A connection must say hello by then, s."""
    idle_timeout: Annotated[float, Field(ge=3, le=3_600)] = 30.0
    """A connection without any message for so long is closed, s."""


_REAL_DEADLINE, _EMULATED_DEADLINE = 0.1, 0.4


class WatchdogSettings(SettingsTable):
    """The process that stops the robot when the server's event loop stands still."""

    deadline: WatchdogDeadline = None
    """It stops the robot when the loop did not tick for so long, s; never above 0.1 on a real one.
    "by controller" is 0.1, and 0.4 on one that says it is emulated."""

    @property
    def real_deadline(self) -> float:
        """How long a controller that may be a real one is left alone [s]."""
        return _REAL_DEADLINE if self.deadline is None else min(self.deadline, _REAL_DEADLINE)

    @property
    def emulated_deadline(self) -> float:
        """How long a controller is left alone that says it is emulated [s]."""
        return _EMULATED_DEADLINE if self.deadline is None else self.deadline


class Modes(SettingsTable):
    """The modes of operation and the enabling device (training)."""

    selector: Literal["server", "controller"] = "server"
    """Who sets the mode: pendants through the server, or the controller's own selector."""
    initial: Literal["manual_reduced", "manual_high", "automatic", "recovery"] = "automatic"
    """The mode at start, where the server's selector rules."""
    enabling_deadline: Annotated[float, Field(ge=0.05, le=0.25)] = 0.15
    """The enabling device counts as released after so long without a message, s."""


class JogSettings(SettingsTable):
    """Jogging by hold-to-run and by increments."""

    joint_speed: Annotated[float, Field(gt=0, le=1)] = 0.25
    """Full jog speed of a joint, of its limit."""
    tool_speed: Annotated[float, Field(gt=0, le=2)] = 0.25
    """Full jog speed of the tool, m/s."""
    rotation_speed: Annotated[float, Field(gt=0, le=6)] = 0.8
    """Full jog speed about an axis of a frame, rad/s."""
    lead: Annotated[float, Field(ge=0.02, le=0.1)] = 0.05
    """How far set-points of a jog are sent ahead of the robot, s."""


CellName = Annotated[str, AfterValidator(_check_name)]


class OwnTables(SettingsTable):
    """What each cell has for itself, however many a server has."""

    name: CellName = "cell"
    """Name of the cell, at most 32 bytes; pendants may ask for it in their hello."""
    robot: str = "ur5"
    """Name of a robot of the catalogue, or path of a robot file."""
    controller: ControllerLink = ControllerLink()
    ros_i: RosSettings = RosSettings()
    modes: Modes = Modes()
    jog: JogSettings = JogSettings()


class StoreFile(SettingsTable):
    """Where programs and all other documents are kept."""

    path: str = ""
    """The file; empty for that of the user who starts the server, "off" to keep nothing."""


class SharedTables(SettingsTable):
    """What all cells of a server have in common, but for where it listens."""

    tick_rate: Annotated[int, Field(ge=50, le=250)] = 100
    """Control rate, Hz."""
    niceness: Annotated[int, Field(ge=-20, le=19)] = -10
    """Scheduling priority that the server asks the system for."""
    event_loop: EventLoop = "asyncio"
    """Python's own, or uvloop, which the extra `fast` installs."""
    pendants: Pendants = Pendants()
    watchdog: WatchdogSettings = WatchdogSettings()
    store: StoreFile = StoreFile()
    tls: TlsSettings = TlsSettings()
    access: AccessSettings = AccessSettings()
    gateways: Annotated[
        tuple[GatewaySettings, ...], Field(max_length=16), AfterValidator(_check_gateways)
    ] = ()
    """Programs that open connections for browsers."""


class CellSettings(OwnTables, SharedTables):
    """Everything that one cell's configuration file may say to the server."""

    listen: Listen = Listen()


_OF_ITS_CONTROLLER = frozenset({"path_tolerance", "lag", "noise"})
"""Keys of `controller` that mean something else where nobody names them: `tracking_tolerances`."""


def settings_as_data(settings: CellSettings) -> dict[str, Any]:
    """Return plain JSON data from which settings are made that say the same, and name the same."""
    unnamed = _OF_ITS_CONTROLLER - settings.controller.model_fields_set
    return settings.model_dump(mode="json", exclude={"controller": set(unnamed)})


def make_settings(data: dict[str, Any], source: str) -> CellSettings:
    """Check plain data and return settings.

    Args:
        data: as read from TOML, possibly overridden by arguments.

    Raises:
        ConfigurationError: the first key that is unknown or out of bounds.
    """
    return checked(CellSettings, data, source)


class ControllerPath(Enum):
    """What a connection to the controller is for."""

    MOTION = "points and their answers"
    STATE = "its reports"
    STOP = "a second motion connection for nothing but STOP"
