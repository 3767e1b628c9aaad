"""Go the walks and print what they cost: `make walk`."""

import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parents[1])  # tests/, as pytest has it

from walks.walk_report import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
