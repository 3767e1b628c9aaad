"""The file of management requests and their answers: one JSON object a line.

    {"cell": "frames", "do": {"wait": 100}}
    {"cell": "frames", "id": "frames.show: right", "by": "viewer", "body": "…", "done": true,
     "answer": "…"}

All lines of a cell are made in one, in order. One that is not recorded yet has no answer. A body
is its text; a list of texts, each with how often it is repeated where it is; or `hex` where it is
no text.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

Body: TypeAlias = str | list[str | list[Any]] | dict[str, str]


@dataclass(frozen=True)
class Question:
    name: str
    by: str
    body: Body

    @property
    def bytes(self) -> bytes:
        match self.body:
            case str():
                return self.body.encode()
            case dict():
                return bytes.fromhex(self.body["hex"])
        return "".join(
            each if isinstance(each, str) else each[0] * each[1] for each in self.body
        ).encode()


@dataclass(frozen=True)
class Happening:
    """What happens between requests; see `AskedCell.do`."""

    what: Mapping[str, Any]


@dataclass(frozen=True)
class Answer:
    done: bool
    text: str


Step: TypeAlias = Question | Happening


def line_of(cell: str, step: Step, answer: Answer | None) -> str:
    if isinstance(step, Happening):
        return json.dumps({"cell": cell, "do": step.what})
    assert answer is not None
    about = {"cell": cell, "id": step.name, "by": step.by, "body": step.body}
    return json.dumps({**about, "done": answer.done, "answer": answer.text}, ensure_ascii=False)


def read_steps(file: Path) -> Iterator[tuple[str, Step, Answer | None]]:
    for line in file.read_text("utf-8").splitlines():
        read = json.loads(line)
        if "do" in read:
            yield read["cell"], Happening(read["do"]), None
        else:
            question = Question(read["id"], read["by"], read["body"])
            answer = Answer(read["done"], read["answer"]) if "done" in read else None
            yield read["cell"], question, answer
