"""The knowledge of learning agents, kept beside the rows, so that a batch can be continued.

The manifest holds their knowledge after some episode. Episodes between that one and the last row
are played once more, only to learn from them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import Executor
from typing import Any

from cavsumo.batch.choosers import chooser
from cavsumo.batch.dispatch import run_batch
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.tally import Row

CHECKPOINT_EVERY = 20  # learning episodes between two records of the knowledge


class Knowledge:
    """The knowledge of the learning agents of a batch.

    Attributes:
        memories: by agent, its knowledge.
        after: by agent, the last episode from which it learned.
        owed: episodes with a recorded row from which the agents have not learned.
        searches: by agent, its search or its estimate.
    """

    def __init__(self, prepared: PreparedBatch, recorded: Mapping[str, Any]) -> None:
        self.names = prepared.cast.learners
        known, after = recorded.get("learned", {}), recorded.get("learned_after", {})
        self.memories = {name: known[name] for name in self.names if name in known}
        self.after = {name: int(after.get(name, -1)) for name in self.names}
        self.owed: list[int] = []
        self._prepared, self._unnoted = prepared, 0
        self.searches = {label: chooser(prepared, label) for label in prepared.cast.searchers}

    @property
    def looks_at_rows(self) -> bool:
        """Whether any agent takes up recorded rows."""
        return bool(self.names or self.searches)

    def seen(self, row: Row) -> None:
        """Take up a recorded row."""
        run, agent = int(row["run"]), row["agent"]
        if agent in self.searches:
            self.searches[agent].told(row)
        if agent in self.names and run > self.after[agent] and row["outcome"] != "error":
            self.owed.append(run)

    def learned(self, row: Row, memory: Any) -> bool:
        """Take up a played episode; returns whether an agent learned from it."""
        if row["agent"] not in self.names:
            return False
        self.memories[row["agent"]], self.after[row["agent"]] = memory, row["run"]
        self._unnoted += 1
        return True

    @property
    def due(self) -> bool:
        """Whether it is time to record the knowledge."""
        return self._unnoted >= CHECKPOINT_EVERY

    def catch_up(self, executor: Executor) -> None:
        """Play the episodes from which the agents have not learned."""
        for answer in run_batch(self._prepared, executor, self.owed, memories=self.memories):
            self.learned(answer.outcome.row, answer.memory)
        self.owed = []

    def known(self) -> tuple[dict[str, Any], dict[str, int]]:
        """The present knowledge, for ``restore``."""
        return dict(self.memories), dict(self.after)

    def restore(self, known: tuple[dict[str, Any], dict[str, int]]) -> None:
        """Restore an earlier knowledge."""
        self.memories, self.after = known

    def forget(self, names: Iterable[str]) -> None:
        """Let agents start anew."""
        for name in names:
            self.memories.pop(name, None)
            if name in self.searches:
                self.searches[name] = chooser(self._prepared, name)

    def facts(self) -> dict[str, Any]:
        """The knowledge, for the manifest."""
        self._unnoted = 0
        return {"learned": dict(self.memories), "learned_after": dict(self.after)}
