"""What learning agents know, kept beside the rows, so that a batch can go on where it stopped.

The manifest holds what they knew after some episode. Episodes between that one and the last row
are played once more, for the lesson only.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from typing import Any

from cavsumo.batch.dispatch import run_batch
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.tally import Row

CHECKPOINT_EVERY = 20  # lessons between two notes of what is known


class Lessons:
    """What the learning agents of a batch know.

    Attributes:
        memories: by agent, what it knows.
        after: by agent, the episode that taught it last.
        owed: episodes whose rows are there and whose lesson is not.
    """

    def __init__(self, prepared: PreparedBatch, recorded: Mapping[str, Any]) -> None:
        self.names = prepared.cast.learners
        known, after = recorded.get("learned", {}), recorded.get("learned_after", {})
        self.memories = {name: known[name] for name in self.names if name in known}
        self.after = {name: int(after.get(name, -1)) for name in self.names}
        self.owed: list[int] = []
        self._prepared, self._unnoted = prepared, 0

    def seen(self, row: Row) -> None:
        """A row that was there already."""
        run, agent = int(row["run"]), row["agent"]
        if agent in self.names and run > self.after[agent] and row["outcome"] != "error":
            self.owed.append(run)

    def learned(self, row: Row, memory: Any) -> bool:
        """An episode was played; whether it taught something."""
        if row["agent"] not in self.names:
            return False
        self.memories[row["agent"]], self.after[row["agent"]] = memory, row["run"]
        self._unnoted += 1
        return True

    @property
    def due(self) -> bool:
        """Whether it is time to note what is known."""
        return self._unnoted >= CHECKPOINT_EVERY

    def catch_up(self, executor: Executor) -> None:
        """Play the episodes whose lesson is owed."""
        for answer in run_batch(self._prepared, executor, self.owed, memories=self.memories):
            self.learned(answer.outcome.row, answer.memory)
        self.owed = []

    def known(self) -> tuple[dict[str, Any], dict[str, int]]:
        """What is known now, to be restored later."""
        return dict(self.memories), dict(self.after)

    def restore(self, known: tuple[dict[str, Any], dict[str, int]]) -> None:
        """Know what was known then."""
        self.memories, self.after = known

    def forget(self, names: Iterable[str]) -> None:
        """Let agents start anew."""
        for name in names:
            self.memories.pop(name, None)

    def facts(self) -> dict[str, Any]:
        """What is known, for the manifest."""
        self._unnoted = 0
        return {"learned": dict(self.memories), "learned_after": dict(self.after)}
