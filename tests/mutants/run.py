"""Plant the faults of the table and see whether the tests find them: `make mutants`."""

import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parents[1])  # tests/, as pytest has it

from mutants.command_line import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
