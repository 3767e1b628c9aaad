"""`python -m openpendant.server`: the same as `openpendant serve`."""

from __future__ import annotations

import sys

from .cli.serve import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
