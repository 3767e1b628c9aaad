"""An input device that a test plugs in and pulls out: a pipe with a name."""

import os
from pathlib import Path


class PluggedDevice:
    """One device; its name tells its kind, as those of the kernel do."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._end: int | None = None

    def plug(self) -> None:
        os.mkfifo(self.path)
        # For reading, too: else there must be a reader first.
        self._end = os.open(self.path, os.O_RDWR | os.O_NONBLOCK)

    def write(self, data: bytes) -> None:
        assert self._end is not None
        os.write(self._end, data)

    def pull(self) -> None:
        if self._end is not None:
            self.path.unlink()
            os.close(self._end)
            self._end = None
