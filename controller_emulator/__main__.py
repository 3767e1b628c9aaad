"""`python -m openpendant.controller_emulator`: the same as `openpendant emulate`."""

from __future__ import annotations

import gc
import sys


def _main() -> int:
    # Start-up makes objects that stay; looking for garbage among them takes a tenth of its time.
    gc.disable()
    from .shell.cli import main

    return main()


sys.exit(_main())
