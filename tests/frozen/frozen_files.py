"""Where the frozen evidence is."""

from pathlib import Path

FROZEN = Path(__file__).parent
JOURNALS = FROZEN / "journals"
FILES = FROZEN / "files"
READINGS = FILES / "readings.json"
BODIES = FROZEN / "bodies.jsonl"
SIGNATURES = FROZEN / "client_signatures.txt"
QUESTIONS = FROZEN / "questions.txt"
SCHEMAS = FROZEN.parents[1] / "docs" / "generated" / "schemas"
