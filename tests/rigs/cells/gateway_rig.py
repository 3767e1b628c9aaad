"""A server that knows three gateways, of which one shares its address with other programs.

Everything is that of `guarded_bytes`; connections come through a gateway, past it, or directly from
the address that is meant.
"""

from rigs.cells.admission_desk import BOOK, Desk
from rigs.cells.byte_rig import ByteClient
from rigs.cells.guarded_bytes import GuardedBytes

from openpendant.server.access.accounts import AccountBook
from openpendant.server.access.gateways import Gateway
from openpendant.server.access.lockout import ip_of
from openpendant.server.access.passwords import Secret
from openpendant.simplemsg import HeaderOnly, ReplyCode
from openpendant.simplemsg.pendant import Forwarded

SECRET = "0123456789abcdef" * 4
SHARED = "127.0.0.1"
"""Address of the gateway `web`, from which every program of this machine comes."""

ALONE = "127.0.0.2"
"""Address of the gateway `own`, from which nobody else comes."""

FAR = "198.51.100.5"
"""Address of the gateway `far`, which is another machine."""

GATEWAYS = (
    Gateway("web", ip_of(SHARED), Secret(SECRET)),
    Gateway("own", ip_of(ALONE), Secret(SECRET[::-1])),
    Gateway("far", ip_of(FAR), Secret(SECRET[::-1])),
)
FORWARDED = Forwarded.PLACE.msg_type


def forwarded(address: str, *, is_encrypted: int = 1) -> Forwarded:
    """Return what the gateway `web` says."""
    return Forwarded("web", SECRET, address, is_encrypted)


class GatewayRig(GuardedBytes):
    """The server and its connections."""

    def __init__(self, *, has_accounts: bool = True, **listen: int) -> None:
        self.has_accounts = has_accounts
        book = BOOK if has_accounts else AccountBook()
        desk = Desk(book, single_user_host=not has_accounts, gateways=GATEWAYS)
        super().__init__(checks_at_once=True, desk=desk, **listen)

    def through(self, address: str) -> ByteClient:
        """Have a connection of an address come through the gateway `web`."""
        client = self.come(SHARED)
        client.tell(forwarded(address))
        assert is_taken(client)
        return client

    @property
    def counted(self) -> list[str]:
        """The addresses that connections with a place are charged to."""
        return [place.source for place in self.desk.login.places]


def is_taken(client: ByteClient) -> bool:
    """Return True if a FORWARDED was believed, False if it was refused by a bare header."""
    (told,) = client.heard()
    assert isinstance(told, HeaderOnly)
    assert told.msg_type == FORWARDED
    return told.reply_code == ReplyCode.SUCCESS
