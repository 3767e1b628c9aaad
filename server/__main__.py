"""`python -m openpendant.server`: the same as `openpendant serve`."""

from __future__ import annotations

import gc
import sys


def _main() -> int:
    # Start-up makes objects that stay; looking for garbage among them takes a tenth of its time.
    gc.disable()
    from .cli.serve import main

    return main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(_main())
