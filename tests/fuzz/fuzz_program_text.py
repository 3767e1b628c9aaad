"""Program files: text and JSON are read or refused, and what was read comes back as it was."""

from collections.abc import Iterator

from rigs.data.program_samples import HEAD

from openpendant.server.programs.language.parser import parse, parse_bytes
from openpendant.server.programs.language.printer import print_program
from openpendant.server.programs.language.program_errors import program_refusal
from openpendant.server.programs.language.program_json import program_from_json, program_to_json
from openpendant.simplemsg.pendant.management.program_values import ProgramError
from openpendant.simplemsg.verdicts import CATALOGUE

from .choices import Choices


def TestOneInput(data: bytes) -> None:
    choices = Choices(data)
    form, body = choices.number(3), choices.rest()
    try:
        if form == 0:
            program = program_from_json(body)
        else:
            # Most bytes are no header: the second form begins behind one.
            head = HEAD.encode() if form == 2 else b""
            program = parse_bytes(head + body).program
    except ProgramError as error:
        refusal = program_refusal(error)
    else:
        assert parse(print_program(program)) == program
        assert program_from_json(program_to_json(program)) == program
        return
    assert refusal.code in CATALOGUE
    assert 0 < len(refusal.text) < 1_000


def seeds() -> Iterator[bytes]:
    body = """point "d e"  # beside
  joints 1 2 3 4 5 6 rad
  pose 1 2 3 mm rpy 1 2 3 deg frame table tool "g 1"
  config front up flip turns 0 0 0 0 0 -1
# go
move PTP a speed 50 % zone 5 deg
loop 3  # thrice
  move LIN b speed 250 mm/s zone 10 mm
  move CIRC c via a dwell 0.5 s
  move SPLINE "d e" via a b c speed 1 m/s
end
"""
    rest = """if input 3 on
  wait 2.5 s
else
  wait input 4 off timeout 5 ms
end
read input 3 into ok
if flag ok off
  attach part
  detach part
  set output 1 on
  call "an other"
end
"""
    yield b"\x02" + body.encode()
    yield b"\x02" + rest.encode()
    yield b"\x01" + (HEAD + body).encode()
    yield b"\x01\xef\xbb\xbf" + HEAD.replace("\n", "\r\n").encode()
    yield b"\x02" + b"loop\n" * 40
    yield b"\x00" + program_to_json(parse(HEAD + body + rest)).encode()
