"""The faults in words: what each does, what a correct peer does about it, what a script says.

Owns these texts; `openpendant packets faults --list` and `--explain` print them.
"""

from __future__ import annotations

from collections.abc import Iterator
from inspect import getdoc

from .fault_script import RULE_CLASSES, FaultScript, Match, Rule

CORRECT_PEER = {
    "delay": "waits, up to its own deadline; then gives up with a reason and takes no late reply"
    " for the answer to a newer request",
    "split": "puts the frame together again, however it is cut",
    "coalesce": "takes every frame out of what it received, and loses none",
    "drop": "a client notices by its deadline that no reply comes; a server need not notice",
    "duplicate": "a server moves to a repeated point once; a client ignores a reply nobody asked"
    " for",
    "corrupt": "refuses what it can tell is wrong and never moves by it; after a length that lies"
    " it closes the connection, after a wrong body it goes on",
    "reset": "a server stops the motion within a tick; a client connects again and starts anew,"
    " never in the middle",
    "close": "as for reset",
    "half_open": "notices within about three seconds that nobody is there, and frees the"
    " connection",
    "lost_reply": "a client gives up by its deadline and sends STOP; a server that sees the same"
    " point again moves once",
    "refuse": "a client sends nothing more of that motion, and says so to its user",
    "busy": "a Motoman client sends the same point again a little later; others wait without"
    " sending the next",
    "wrong_byte_order": "refuses the connection or frame, and never moves by values read backwards",
    "throttle": "does not overfill its buffers; state that is too old by then is not used",
    "reorder": "refuses points out of sequence, and STOP still wins",
}
"""What a correct peer does, by fault."""


def list_faults() -> str:
    """Return all faults with what they do, their parameters, and what a correct peer does."""
    return "\n".join(line for name in RULE_CLASSES for line in _entry(name))


def _entry(name: str) -> Iterator[str]:
    cls = RULE_CLASSES[name]
    about = (getdoc(cls) or "").partition("\n")[0]
    yield f"{name}: {about}"
    for key, field in cls.model_fields.items():
        if key in ("fault", "match"):
            continue
        default = "" if field.is_required() else f" (default {_shown(field.default)})"
        meaning = " ".join((field.description or "").split())
        yield f"    {key}: {meaning.rstrip('.')}{default}"
    yield f"    a correct peer: {CORRECT_PEER[name]}"


def _shown(value: object) -> str:
    match value:
        case None | ():
            return "none"
        case bool():
            return str(value).lower()
        case float():
            return f"{value:g}"
    return str(value)


def explain(script: FaultScript) -> str:
    """Return a script in words, one line a rule."""
    lines = [script.about] if script.about else []
    lines.append(f"messages: {script.dialect}, seed: {script.seed}")
    lines += [f"rule {number}: {_rule(rule)}" for number, rule in enumerate(script.rule, 1)]
    lines.append("every other frame passes as it is")
    return "\n".join(lines)


def _rule(rule: Rule) -> str:
    about = (getdoc(type(rule)) or "").partition("\n")[0].rstrip(".").lower()
    given = {
        key: value
        for key, value in rule.model_dump(mode="json").items()
        if key not in ("fault", "match") and value not in (None, (), [])
    }
    parameters = ", ".join(f"{key} {_shown(value)}" for key, value in given.items())
    done = f"{about} ({parameters})" if parameters else about
    return f"{_whom(rule.match)}: {rule.fault}, which {done}"


_WHOM = {
    "type": "of type {}",
    "comm": "that is a {}",
    "reply_code": "with reply code {}",
    "sequence": "with sequence {}",
    "connection": "on connection {}",
    "pair": "of pair {}",
    "after_s": "from {:g} s on",
    "before_s": "before {:g} s",
    "nth": "but only no. {}",
    "probability": "with probability {:g}",
    "times": "at most {} times",
}


def _whom(match: Match) -> str:
    parts = ["every frame" if match.every is None else f"every frame no. {match.every} of those"]
    ways = {"to_server": "from client to server", "to_client": "from server to client"}
    if match.direction is not None:
        parts.append(ways[match.direction.value])
    given = match.model_dump(mode="json")
    parts += [text.format(given[key]) for key, text in _WHOM.items() if given[key] is not None]
    return " ".join(parts)
