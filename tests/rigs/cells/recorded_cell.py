"""A recorder on a hand-driven clock with a store whose answers come when asked for."""

from collections import deque
from collections.abc import Sequence
from pathlib import Path

from rigs.data.stored_documents import answer_of, noon

from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.events.effects import Ask, Effect
from openpendant.server.events.pending import Pending
from openpendant.server.recording.recorder import Recorder
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.server.store.recording_format import RecordingDocument, Row, unpack_rows
from openpendant.server.store.sqlite_store import open_store
from openpendant.server.store.store_errors import StoreError
from openpendant.simplemsg import JointFeedback, ValidField, joint_array

MS = 1_000_000
JOINTS = ("shoulder", "elbow")


class RecordedCell:
    """A recorder, the reports of a controller with two joints, and a store in a file."""

    def __init__(self, folder: Path) -> None:
        self.store = open_store(folder / "store.db", wall_clock=noon)
        self.answers_at_once = True
        self.pending = Pending()
        self.asked: deque[Ask] = deque()
        self.refuse_with: StoreError | None = None
        self.recorder = Recorder("two-joints", JOINTS, 0.01, self.pending.ask)
        self.feedback = Feedback(2, ControllerLink())
        self.now = 1_000_000_000
        self.told: list[RecordingDocument | Refusal] = []
        self.lost: list[Refusal] = []

    def perform(self, outgoing: list[Effect]) -> None:
        """Have the store answer, at once or when `answer` is called."""
        self.asked.extend(item for item in outgoing if isinstance(item, Ask))
        while self.answers_at_once and self.asked:
            self.answer()

    def answer(self) -> None:
        """Have the store answer the oldest request."""
        asked = self.asked.popleft()
        answer = self.refuse_with or answer_of(self.store, asked.question)
        self.perform(self.pending.resume(asked, answer, self.now))

    def answer_all(self) -> None:
        while self.asked:
            self.answer()

    def tell(self, ended: RecordingDocument | Refusal, now: int) -> list[Effect]:
        self.told.append(ended)
        return []

    def lose(self, why: Refusal, now: int) -> list[Effect]:
        self.lost.append(why)
        return []

    def start(self, name: str = "arc") -> Refusal | list[Effect]:
        return self._performed(self.recorder.start(name, "ann", self.tell, self.lose))

    def stop(self) -> Refusal | list[Effect]:
        return self._performed(self.recorder.stop(self.tell))

    def _performed(self, result: Refusal | list[Effect]) -> Refusal | list[Effect]:
        if not isinstance(result, Refusal):
            self.perform(result)
        return result

    def report(self, position: Sequence[float], after_ms: int = 10) -> None:
        """Let time pass and the controller report; the recorder sees it twice, as with STATUS."""
        self.now += after_ms * MS
        message = JointFeedback(
            0, int(ValidField.ALL), 0.0, joint_array(position), joint_array(()), joint_array(())
        )
        self.feedback.take(message, self.now)
        self.perform(self.recorder.reported(self.feedback, self.now))
        self.perform(self.recorder.reported(self.feedback, self.now + MS))

    def reports(self, count: int) -> None:
        for _ in range(count):
            self.report((0.0, 0.0))

    def ticks(self, count: int) -> None:
        for _ in range(count):
            self.tick()

    def tick(self, after_ms: int = 10) -> None:
        self.now += after_ms * MS
        self.perform(self.recorder.tick(self.now))

    def rows(self, name: str = "arc") -> list[Row]:
        chunks = self.store.load_chunks(name, 0, 1_000)
        return [row for chunk in chunks for row in unpack_rows(chunk, 4)]
