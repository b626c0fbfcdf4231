"""Playing a batch into its results file: from the start, continued, or errors again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cavsumo.batch.dispatch import run_batch
from cavsumo.batch.estimating import EstimateFacts, Estimating
from cavsumo.batch.learning import Knowledge
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import OUTPUTS, PreparedBatch
from cavsumo.batch.progress import Progress
from cavsumo.batch.searching import SearchFacts, Searching
from cavsumo.batch.stopping import stopping_rule
from cavsumo.batch.tally import Tally
from cavsumo.egos.ego_files import OutputWatch
from cavsumo.errors import BatchError
from cavsumo.results.reading import COMPLETE, STARTING, check_cells, rows_of
from cavsumo.results.rows import Outcome
from cavsumo.results.writing import Recorder

LARGE = 8 << 20  # bytes from which rows are worth the import of pandas, which takes 0.4 s
LOOK_AHEAD = 4  # episodes under way or waiting for their turn, for each that is played at a time


@dataclass
class BatchRun:
    """A running batch; call ``begin`` or ``resume``, then ``play`` or ``retry``, then ``end``.

    Attributes:
        prepared, recorder: the batch, and the writer of its results.
        executor, jobs: the executor, and the number of episodes at a time.
        stopped: returns whether the user asked to stop.
        quiet: no progress.
        tally: the counts, earlier sessions included.
        status: finished, stopped (by a rule), interrupted or broken.
        cut_short: whether the user stopped it before all errors were played again.
        left_out: the inputs that are too large to be kept with the results.
    """

    prepared: PreparedBatch
    recorder: Recorder
    executor: Executor
    jobs: int
    stopped: Callable[[], bool]
    quiet: bool = True
    tally: Tally = field(default_factory=Tally)
    status: str = "broken"
    cut_short: bool = False
    left_out: list[Path] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._noted = False
        self._watch = OutputWatch(self.prepared.plan.scenario.ego, self.prepared.checksums)

    def begin(self, manifest: Mapping[str, Any], *, overwrite: bool = False) -> None:
        """Start the results file."""
        self._todo = self.prepared.plan.todo()
        self._knowledge = Knowledge(self.prepared, {})
        self.recorder.begin(manifest, overwrite=overwrite)
        self.left_out = self.recorder.keep(self.prepared.inputs)

    def resume(self, manifest: Mapping[str, Any]) -> None:
        """Take up the recorded rows."""
        self._todo = self.prepared.plan.todo()
        self._knowledge = Knowledge(self.prepared, manifest)
        if not self._taken_up(manifest):
            self.tally.add_rows(self._recorded(manifest))
        self._knowledge.catch_up(self.executor)
        self.left_out = self.recorder.keep(self.prepared.inputs)
        recorded = manifest["status"]
        self.status = recorded if recorded in COMPLETE else "interrupted"

    def _taken_up(self, manifest: Mapping[str, Any]) -> bool:
        """Take up the rows of a large batch of which nobody needs each; whether that is done."""
        csv_file, starting = self.recorder.csv_file, manifest["status"] == STARTING
        if starting or self._knowledge.looks_at_rows or csv_file.stat().st_size < LARGE:
            return False
        from cavsumo.batch.resume_large import taken_up  # which imports pandas

        found = taken_up(csv_file, self.prepared.plan.todo())
        if found is None:
            return False
        self.recorder.resume_after(manifest, found.written)
        self.tally, self._todo = found.tally, found.todo
        return True

    def _recorded(self, manifest: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
        """The recorded rows, checked, and seen by those who learn from them."""
        for row in self.recorder.resume(manifest, self._todo):
            check_cells(self.recorder.csv_file, row)
            self._knowledge.seen(row)
            yield row

    def play(self) -> None:
        """Play the remaining episodes, until the end or a reason to stop."""
        self.status = "broken"
        rule = stopping_rule(self.prepared.plan)
        reason = rule(self.tally) or self._estimated()
        with Progress(self.prepared.plan.size, self.quiet, self.tally.rows) as progress:
            for answer in self._answers(self._todo, progress) if reason is None else ():
                row = self.recorder.write(answer.outcome)
                self.tally.add(row)
                learned = self._knowledge.learned(row, answer.memory) and self._knowledge.due
                if self._note_outputs() or learned:
                    self.recorder.checkpoint(self._knowledge.facts())
                progress.update(self.tally)
                reason = rule(self.tally) or self._estimated(int(row["run"]))
                if reason is not None:
                    break
        missing = self.tally.rows < self.prepared.plan.size
        self.status = "stopped" if reason else "interrupted" if missing else "finished"
        self.recorder.manifest["stopped_by"] = reason

    def retry(self) -> None:
        """Play the episodes again that ended in errors.

        A learning agent did not learn from such an episode: it starts anew, and its later rows
        change.
        """
        todo, relearning = _to_retry(
            self.recorder.csv_file, self._knowledge.names | self.prepared.cast.searchers
        )
        known = self._knowledge.known()
        self._knowledge.forget(relearning)
        replaced: dict[int, Outcome] = {}
        with Progress(len(todo), self.quiet) as progress:
            for answer in self._answers(todo, progress):
                row = answer.outcome.row
                self._knowledge.learned(row, answer.memory)
                replaced[row["run"]] = answer.outcome
                progress.update(self.tally)
        self.cut_short = len(replaced) < len(todo)
        if self.cut_short and relearning:
            self._knowledge.restore(known)
            raise BatchError("interrupted before the learning agents were done: nothing changed")
        self.recorder.replace(replaced)
        self.tally = Tally()
        self.tally.add_rows(rows_of(self.recorder.csv_file))

    @property
    def searches(self) -> dict[str, SearchFacts]:
        """The findings of the searching agents."""
        found = self._knowledge.searches.items()
        return {label: one.facts() for label, one in found if isinstance(one, Searching)}

    @property
    def estimates(self) -> dict[str, EstimateFacts]:
        """The results of the estimating agents."""
        found = self._knowledge.searches.items()
        return {label: one.facts() for label, one in found if isinstance(one, Estimating)}

    def _estimated(self, run: int | None = None) -> str | None:
        """Why the batch ends with this episode, or with those recorded: its estimate is over."""
        found = self._knowledge.searches.values()
        ends = [one.over(run) for one in found if isinstance(one, Estimating)]
        return next(filter(None, ends), None)

    def end(self) -> None:
        """Complete the manifest."""
        self._note_outputs()
        self.recorder.finish(self.status, self.tally.facts() | self._knowledge.facts())

    def _note_outputs(self) -> bool:
        """Record the files that the ego has written in the manifest; returns whether any is new."""
        noted = self.recorder.manifest
        before = set(noted.get(OUTPUTS) or ())
        found = before.union(self._watch.outputs())
        if found == before:
            return False
        noted[OUTPUTS] = sorted(found)
        noted["sha256"] = {k: v for k, v in noted["sha256"].items() if k not in found}
        return True

    def _answers(self, todo: Iterable[int], progress: Progress) -> Iterator[Answer]:
        """Play episodes by the executor; what its processes note is said once."""
        for answer in run_batch(
            self.prepared,
            self.executor,
            todo,
            memories=self._knowledge.memories,
            searches=self._knowledge.searches,
            ahead=LOOK_AHEAD * self.jobs,
            stopped=self.stopped,
        ):
            if answer.note and not self._noted:
                self._noted = True
                progress.say(f"cavsumo: SUMO is started for every episode: {answer.note}")
            yield answer


def _to_retry(csv_file: Path, learners: frozenset[str]) -> tuple[list[int], frozenset[str]]:
    """The episodes to play again, and the learners that start anew because they have any.

    Those are all episodes of such a learner, and the errors.
    """
    runs: dict[str, list[int]] = {name: [] for name in learners}
    again, relearning = set[int](), set[str]()
    for row in rows_of(csv_file):
        if row["agent"] in learners:
            runs[row["agent"]].append(int(row["run"]))
        if row["outcome"] == "error":
            again.add(int(row["run"]))
            relearning |= {row["agent"]} & learners
    again |= {run for name in relearning for run in runs[name]}
    return sorted(again), frozenset(relearning)
