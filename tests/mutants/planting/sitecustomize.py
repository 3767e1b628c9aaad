"""Python imports this at its start where its folder is on PYTHONPATH: plants the fault asked for.

So the fault reaches a test's own process and every Python process that a test starts.
"""

import importlib
import os

if os.environ.get("OPENPENDANT_MUTANT"):
    importlib.import_module("planted_fault").plant(os.environ["OPENPENDANT_MUTANT"])
