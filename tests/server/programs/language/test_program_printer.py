"""Programs come back from text and JSON exactly as they were."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from rigs.data.example_counts import examples
from rigs.data.program_samples import HEAD, programs

from openpendant.server.programs.language.parser import parse, parse_source
from openpendant.server.programs.language.printer import print_program, statement_lines
from openpendant.server.programs.language.program import Program
from openpendant.server.programs.language.program_errors import ProgramTooLarge
from openpendant.server.programs.language.program_json import program_from_json, program_to_json
from openpendant.simplemsg.pendant.management.statements import Comment


@settings(max_examples=examples(20, in_soak=5_000))
@given(programs())
def test_every_program_comes_back_from_its_text(program: Program) -> None:
    text = print_program(program)
    source = parse_source(text)
    assert source.program == program
    assert source.statement_lines == statement_lines(program)
    assert print_program(source.program) == text


@settings(max_examples=examples(20, in_soak=5_000))
@given(programs())
def test_every_program_comes_back_from_its_json(program: Program) -> None:
    assert program_from_json(program_to_json(program)) == program


def test_the_layout_is_canonical() -> None:
    text = (
        HEAD
        + """point "d e" joints 1 0 0 0 0 0.5 rad pose 1 2 3 mm quat 0 0 0 1
  # go
  loop 3 # thrice
move  LIN a speed 0.25 m/s zone 1 mm
if flag ok on
wait 500 ms
  else
set output 1 off
end
end"""
    )
    printed = print_program(parse(text))
    assert (
        printed.partition('point "d e"')[2]
        == """
  joints 57.29577951308232 0 0 0 0 28.64788975654116 deg
  pose 1 2 3 mm quat 0 0 0 1 frame base tool flange

# go
loop 3  # thrice
  move LIN a speed 250 mm/s zone 1 mm
  if flag ok on
    wait 0.5 s
  else
    set output 1 off
  end
end
"""
    )


def test_a_text_that_could_not_be_read_back_is_not_printed() -> None:
    comment = Comment(comment="ß" * 200)
    with pytest.raises(ProgramTooLarge, match="bytes in the text of long; accepted: up to 1048576"):
        print_program(Program("long", "ur5", statements=(comment,) * 3_000))
