"""The motion authority: who may move the robot. One holder at a time, for as long as it is alive.

Owns granting, beats, expiry and release, and nothing about what a holder may do.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import AuthorityReason


@dataclass(frozen=True, slots=True)
class Holder:
    """Who holds the authority.

    Attributes:
        session: number of the connection.
        client: its name, shown to others.
    """

    session: int
    client: str

    @property
    def name(self) -> str:
        """The client's name, or its number where it gave none."""
        return self.client or f"session {self.session}"


@dataclass(frozen=True, slots=True)
class AuthorityChange:
    """The authority changed hands.

    Attributes:
        holder: who holds it now, None for nobody.
        reason: why it changed.
    """

    holder: Holder | None
    reason: AuthorityReason


class MotionAuthority:
    """A lease with one holder.

    Attributes:
        holder: who holds it, None for nobody.
    """

    def __init__(self, timeout_ns: int) -> None:
        """Make a free lease that expires `timeout_ns` after its holder's last beat."""
        self.holder: Holder | None = None
        self._timeout_ns = timeout_ns
        self._deadline: int | None = None

    def is_held_by(self, session: int) -> bool:
        """Tell whether a connection holds the authority."""
        return self.holder is not None and self.holder.session == session

    def request(self, holder: Holder, now: int, *, beats: bool) -> AuthorityChange | None:
        """Take the authority if it is free.

        Args:
            holder: who asks.
            now: monotonic time, ns.
            beats: whether the lease expires without beats; a ROS-Industrial link sends none.

        Returns:
            The change; None where somebody has it already, the asker included.
        """
        if self.holder is not None:
            return None
        self.holder = holder
        self._deadline = now + self._timeout_ns if beats else None
        return AuthorityChange(holder, AuthorityReason.GRANTED)

    def beat(self, session: int, now: int) -> None:
        """Prolong the lease; a beat of anybody but the holder, or one too late, does nothing."""
        holder = self.holder
        if holder is None or holder.session != session:
            return
        if self._deadline is not None and now < self._deadline:
            self._deadline = now + self._timeout_ns

    def is_overdue(self, now: int) -> bool:
        """Tell whether the holder has been silent for too long."""
        return self._deadline is not None and now >= self._deadline

    def release(self, session: int, reason: AuthorityReason) -> AuthorityChange | None:
        """Give the authority back; None where the connection does not hold it."""
        if not self.is_held_by(session):
            return None
        self.holder = None
        self._deadline = None
        return AuthorityChange(None, reason)

    def expire(self, now: int) -> AuthorityChange | None:
        """End a lease whose holder has been silent for too long."""
        if self.holder is None or not self.is_overdue(now):
            return None
        return self.release(self.holder.session, AuthorityReason.EXPIRED)
