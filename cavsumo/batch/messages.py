"""What crosses to a process that simulates and back: a task, and what it replies.

Each is pickled once. A row and the text of a trace are made where the episode was played, and pass
as they are into the files; the batch is packed by ``PreparedBatch``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from cavsumo.batch.jobs import Job, Memory
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.results.rows import Outcome

State = Literal["ready", "refused", "goes on", "played", "goodbye"]


@dataclass(frozen=True)
class Task:
    """What a process is asked: first to make ready for a batch, then to play its episodes.

    Attributes:
        batch: what to make ready for, in the first task only.
        strict: whether an ego that cannot be started is a reason to refuse the batch.
        job: the episode to play, in every later task.
    """

    batch: PreparedBatch | None = None
    strict: bool = False
    job: Job | None = None


@dataclass(frozen=True)
class Answer:
    """What an episode came to.

    Attributes:
        outcome: its row, trace and log.
        memory: what its agents know afterwards; None where none of them learns.
    """

    outcome: Outcome
    memory: Memory | None = None


@dataclass(frozen=True)
class Reply:
    """What a process says.

    Attributes:
        state: "ready" or "refused": the answer to the first task; "goes on": another simulation
            begins for the same job; "played"; "goodbye": it had nothing to do for long, and goes.
        reason: why the batch is refused, in one sentence.
        answer: what came of the episode that was played.
    """

    state: State
    reason: str = ""
    answer: Answer | None = None
