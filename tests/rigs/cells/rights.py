"""What a connection may do, and the four sets of rights that there are before a login.

The table of `docs/access.md` names one of them for each place that a connection comes from.
"""

from dataclasses import dataclass, replace

from openpendant.simplemsg.verdicts import VerdictCode as V


@dataclass(frozen=True)
class Rights:
    """What a connection may do, each by the code of its answer.

    Attributes:
        basis: what it was granted without a login.
        shows_cells: the lobby tells it what the cells are doing.
        sends_state: it is sent state.
    """

    basis: str
    shows_cells: bool
    observe: V
    sends_state: bool
    move: V
    stop: V
    reset: V
    login: V


SINGLE_USER = Rights(
    *("single user", True, V.ACCEPTED, True, V.ACCEPTED, V.ACCEPTED, V.ACCEPTED, V.LOGIN_FAILED)
)
ONLY_STOP = Rights(
    *("", False, V.LOGIN_NEEDED, False, V.LOGIN_NEEDED, V.ACCEPTED, V.LOGIN_NEEDED),
    V.LOGIN_FAILED,
)
LOOKS_ON = replace(
    ONLY_STOP, shows_cells=True, observe=V.ACCEPTED, sends_state=True, login=V.ACCEPTED
)
LOGIN_FOR_ALL = replace(ONLY_STOP, login=V.ACCEPTED)
