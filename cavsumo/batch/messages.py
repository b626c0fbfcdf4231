"""The messages to a simulating process and back: a task and a reply.

Each is pickled once. A row and the bytes of a trace are made in the simulating process and pass
unchanged into the files; ``PreparedBatch`` packs the batch.
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
    """A task for a process: first to prepare for a batch, then to play its episodes.

    Attributes:
        batch: the batch to prepare for, in the first task only.
        strict: whether an ego that cannot be started refuses the batch.
        job: the episode to play, in every later task.
    """

    batch: PreparedBatch | None = None
    strict: bool = False
    job: Job | None = None


@dataclass(frozen=True)
class Answer:
    """The result of an episode.

    Attributes:
        outcome: its row, trace and log.
        memory: the knowledge of its agents afterwards; None if none of them learns.
        judged: False for a failure that has yet to be judged (``EpisodeRunner.play``).
        digest: a checksum of all its snapshots, where that was asked for.
        note: why SUMO is started for every episode although the network is large; empty if it is
            not, or if that was said before.
    """

    outcome: Outcome
    memory: Memory | None = None
    judged: bool = True
    digest: str = ""
    note: str = ""


@dataclass(frozen=True)
class Reply:
    """The reply of a process.

    Attributes:
        state: "ready" or "refused": the answer to the first task; "goes on": another simulation
            begins for the same job; "played"; "goodbye": it was idle for long, and ends.
        reason: the reason of a refusal, in one sentence.
        answer: the result of the episode.
    """

    state: State
    reason: str = ""
    answer: Answer | None = None
