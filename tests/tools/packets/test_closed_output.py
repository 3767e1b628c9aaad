"""A tool whose standard output is closed does not say that all is well."""

import sys
from pathlib import Path

import pytest

from openpendant.tools.packets import decode, record, rerun, show

TRACE = str(Path(__file__).parents[2] / "vectors" / "capture-motoman-driver.json")


@pytest.mark.parametrize(
    ("main", "arguments"),
    [
        (decode.main, [TRACE]),
        (show.main, [TRACE]),
        (rerun.main, [TRACE, "--json"]),
        (record.main, ["--listen", "0", "--to", "1", "-o", "-"]),
    ],
    ids=["decode", "show", "rerun", "record"],
)
def test_a_closed_output_is_one_line_and_exit_code_1(
    main: object,
    arguments: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert callable(main)
    with monkeypatch.context() as patched:
        patched.setattr(sys, "stdout", None)
        code = main(arguments)
    assert code == 1
    assert capsys.readouterr().err == "standard output is closed\n"
