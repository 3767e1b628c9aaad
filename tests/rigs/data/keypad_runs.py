"""Runs of the emulated keypad in Python, and the golden frames, as cases for that of the page."""

import json
import random
from pathlib import Path
from typing import Any

from openpendant.simplemsg.serial_frames import (
    COLUMNS,
    ROWS,
    AskHello,
    FrameWriter,
    HostBeat,
    KeypadWelcome,
    LcdPage,
    LcdRow,
    ToKeypad,
)
from openpendant.tools.pendants.keypad.emulated_keypad import MS, EmulatedKeypad
from openpendant.tools.pendants.keypad.keys import KEYS

from .golden_vectors import FOLDER

_RUNS, _STEPS = 12, 150
_STARTED = 5_000
_PAUSES = [1, 3, 4, 9, 30, 60, 400, 1_100, 3_000]
_WELCOMES = ([1, 1, 1, 2], [19, 20, 50, 100, 250, 251], [4, 5, 12, 20, 21])
"""Versions, beats and debounces, those that may be and those that may not."""


class _Bridge:
    """Something that sends what a bridge may send, and rubbish."""

    def __init__(self, choose: random.Random) -> None:
        self._choose = choose
        self._writer = FrameWriter()

    def says(self) -> bytes:
        choose = self._choose
        if choose.random() < 0.15:
            return choose.randbytes(choose.randrange(1, 130))
        data = self._writer.write(self._frame())[1]
        return data if choose.random() < 0.9 else data[choose.randrange(1, len(data)) :]

    def _frame(self) -> ToKeypad:
        choose = self._choose
        text = bytes(choose.choice(b" 0A~\x7f\xff\x01") for _ in range(COLUMNS * ROWS))
        version, beat, debounce = (choose.choice(each) for each in _WELCOMES)
        frames: list[ToKeypad] = [
            KeypadWelcome(version, beat, debounce, 1),
            LcdRow(choose.randrange(6), text[:COLUMNS]),
            LcdPage(text),
            HostBeat(choose.randrange(8)),
            AskHello(),
        ]
        return choose.choice(frames)


def _run(seed: int) -> list[dict[str, Any]]:
    """Return what is done to a keypad, step by step, and what it says and shows."""
    choose = random.Random(seed)
    keypad, bridge, now = EmulatedKeypad(), _Bridge(choose), _STARTED
    keypad.start(now * MS)
    steps = []
    for _ in range(_STEPS):
        step: dict[str, Any] = {}
        if choose.random() < 0.5:
            key = choose.randrange(KEYS)
            step["key"] = key
            (keypad.let_go if key in keypad.pressed else keypad.press)(key)
        if choose.random() < 0.1:
            keypad.pressed.clear()
            step["let_go_of_all"] = True
        if choose.random() < 0.1:
            keypad.button = not keypad.button
            step["button"] = keypad.button
        if choose.random() < 0.01:
            keypad.start(now * MS, 2)
            step["reset"] = True
        if choose.random() < 0.4:
            data = bridge.says()
            keypad.receive(data)
            step["bytes"] = data.hex()
        now += choose.choices(_PAUSES, [4, 4, 16, 4, 4, 4, 2, 2, 1])[0]
        keypad.tick(now * MS)
        steps.append(step | {"now": now, "said": keypad.output().hex(), "lcd": list(keypad.lcd)})
    return steps


def write_keypad_cases(path: Path) -> None:
    """Write the golden frames and the runs as one file of JSON."""
    golden = json.loads((FOLDER / "keypad-frames.json").read_text("utf-8"))
    runs = [_run(seed) for seed in range(_RUNS)]
    path.write_text(json.dumps({"golden": golden, "started": _STARTED, "runs": runs}), "utf-8")
