"""The pendant server, which takes connections as soon as they come: two hundred begin at once."""

import sys

from openpendant.server.__main__ import _main
from openpendant.server.shell import listening

AT_ONCE = 10_000

if __name__ == "__main__":
    assert vars(listening)["BURST"] < AT_ONCE
    vars(listening)["BURST"] = AT_ONCE
    sys.exit(_main())
