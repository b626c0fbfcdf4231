"""A failure made as small as it can be: every candidate is played, and must fail the same way.

The same way: the same assertion is violated by the same pair of bodies, the reference driver says
the same of it (preventable stays preventable), and no tester breaks a rule of the world that none
broke before. The reductions and their order are fixed, so the result is always the same.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

from cavsumo.agents.casting import tester_bodies
from cavsumo.batch.jobs import Job
from cavsumo.batch.playback import AGAIN, NOT_PLAYED_BACK, for_playback, played_back, recording_of
from cavsumo.batch.prepared import prepare
from cavsumo.batch.replay import Record, compare, prepared_again
from cavsumo.batch.replaying import Located
from cavsumo.batch.worker import Worker
from cavsumo.errors import DivergenceError, InputError
from cavsumo.kept.candidate import Candidate, FixedPart, as_recorded
from cavsumo.kept.entries import RouteLanes, entries_at
from cavsumo.kept.reductions import Reductions, Tracks
from cavsumo.kept.shrinking import smallest
from cavsumo.model.scenario import BatchPlan
from cavsumo.network.site import Site
from cavsumo.results.rows import cell
from cavsumo.results.traces import Trace, trace_of

MOST_REPLAYS = 1000
SAME = ("outcome", "assertion", "avoidable")  # columns that every candidate has to keep
TESTER = "tester"  # ids of testers are this and their numbers

Notice = Callable[[int, Candidate], None]  # replays so far, and the smallest candidate


@dataclass(frozen=True)
class Minimised:
    """A failure, and the smallest one that it was reduced to.

    Attributes:
        before, after: their records, both with traces and the present paths of files.
        first, last: what they consist of.
        replays: how many candidates were played.
        complete: whether every single reduction of ``last`` was tried, so that it is 1-minimal.
        site: the place.
    """

    before: Record
    after: Record
    first: Candidate
    last: Candidate
    replays: int
    complete: bool
    site: Site


class _Enough(Exception):
    """No more replays are allowed."""


def minimised(
    record: Record,
    located: Located,
    most: int = MOST_REPLAYS,
    notice: Notice = lambda replays, best: None,
) -> Minimised:
    """The smallest failure to which a recorded one leads.

    Args:
        record: of a failure, with its trace.
        located: gives a record the present paths of its files.
        most: replays; after so many the smallest failure found so far is returned.
        notice: called when a smaller one is found.

    Raises InputError for an episode that is no failure, and for one that is another episode when it
    is played back: its ego does not decide twice alike.
    """
    _check(record)
    there = located(for_playback(record))
    with Replays(there, record, most) as replays:
        replays.check()
        search = Search(replays, notice)
        last = search.smallest()
        again = replays.judged(last)
        complete, played = search.complete, replays.played
        before = dataclasses.replace(
            record,
            plan=record.plan.model_copy(
                update={"scenario": record.plan.scenario.placed(there.plan.scenario.places)}
            ),
        )
        return Minimised(before, again, search.first, last, played, complete, replays.site)


def _check(record: Record) -> None:
    """Refuse what cannot be made smaller."""
    row, run = record.row, record.run
    if row["outcome"] != "violated":
        raise InputError(f"minimise: run {run} is no failure: {row['outcome']}")
    if record.plan.scenario.script is not None:
        raise InputError(f"minimise: run {run} is a case of a suite, whose tests are programmed")
    if record.trace is None or not record.trace.has_recording:
        raise InputError(f"minimise: no trace with actions was kept of run {run}")


class Replays:
    """Plays candidates, in a process for each number of testers; a context manager.

    Attributes:
        fixed: the episode of which they are candidates.
        played: how many were played.
        site: the place.
    """

    def __init__(self, there: Record, record: Record, most: int = MOST_REPLAYS) -> None:
        assert record.trace is not None
        self._record, self._most = there, most
        scenario = there.plan.scenario
        recorded = recording_of(record, record.trace)
        self.fixed = FixedPart(recorded, tester_bodies(scenario)[0].kind, scenario.step_length)
        self._reference = record.plan.reference
        self._workers: dict[int, Worker] = {}
        self._traces: dict[Candidate, Trace] = {}
        self._stack = contextlib.ExitStack()
        self.played = 0
        self._lanes: RouteLanes | None = None
        self.site = prepared_again(there).site  # refuses names that need trust
        self.first = as_recorded(recorded)

    def __enter__(self) -> Replays:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def check(self) -> None:
        """Refuse an episode that is another one when it is played back."""
        worker = self._worker(len(self.first.numbers))
        again = played_back(worker, self._record)
        try:
            compare(self._record, again, NOT_PLAYED_BACK)
        except DivergenceError as error:
            raise InputError(
                f"minimise: run {self._record.run} is another episode when it is played back, so "
                f"nothing can be said of smaller ones ({error})"
            ) from error
        assert again.trace is not None
        self._traces[self.first] = again.trace

    @property
    def met(self) -> str | int:
        """The body of the violation: the number of a tester, or the id of a background body."""
        name = self._record.row["tester"]
        number = name.removeprefix(TESTER)
        return int(number) if name.startswith(TESTER) and number.isdecimal() else name

    def fails_the_same(self, candidate: Candidate) -> bool:
        """Whether a candidate fails as the recorded episode did."""
        if self.played >= self._most:
            raise _Enough
        self.played += 1
        outcome = self._worker(len(candidate.numbers)).play(self._job(candidate)).outcome
        row, was = outcome.row, self._record.row
        if any(cell(row[name]) != was[name] for name in SAME):
            return False
        if row["tester"] != self._name(candidate) or (row["breach"] and not was["breach"]):
            return False
        trace = trace_of(outcome)
        assert trace is not None
        self._traces[candidate] = trace
        return True

    def tracks(self, candidate: Candidate) -> Tracks:
        """How a candidate that fails was played."""
        trace, dt = self._traces[candidate], self.fixed.dt
        end = round(float(trace.row["violation_time_s"]) / dt)
        frames = trace.frames[: end + 1]
        poses = [tuple(tuple(pose) for pose in frame["testers"].values()) for frame in frames]
        if self._lanes is None:
            scenario = self._record.plan.scenario
            self._lanes = RouteLanes(scenario.net_file, self.site.route.edges)
        every = max(1, round(1.0 / dt))
        length = trace.shapes()["ego"].length
        return Tracks(poses, entries_at(self._lanes, frames, length, every))

    def judged(self, candidate: Candidate) -> Record:
        """The record of a candidate, judged in full, as an episode that can be replayed."""
        job = dataclasses.replace(self._job(candidate), briefly=False)
        worker = self._worker(len(candidate.numbers))
        trace = trace_of(worker.play(job).outcome)
        assert trace is not None
        return dataclasses.replace(
            self._record, plan=worker.prepared.plan, row=trace.row, trace=trace, origin=trace.head
        )

    def _name(self, candidate: Candidate) -> str:
        """The id in a candidate of the body of the violation."""
        met = self.met
        return met if isinstance(met, str) else f"{TESTER}{candidate.numbers.index(met)}"

    def _job(self, candidate: Candidate) -> Job:
        """The job that plays a candidate."""
        recorded = candidate.recorded(self.fixed)
        run = self._record.run
        return Job(run, AGAIN, recorded.seed, record=True, recorded=recorded, briefly=True)

    def _worker(self, testers: int) -> Worker:
        """The process that plays episodes with so many testers."""
        if testers not in self._workers:
            plan = _with_testers(self._record.plan, testers, self._reference)
            worker = self._stack.enter_context(Worker(prepare(plan)))
            self._workers[testers] = worker
        return self._workers[testers]


def _with_testers(plan: BatchPlan, testers: int, reference: str) -> BatchPlan:
    """The plan of episodes with so many testers, each moved by itself."""
    alone = {"testers": testers, "bodies_per_agent": 1}
    scenario = plan.scenario.model_copy(update=alone).placed(plan.scenario.places)
    return plan.model_copy(update={"scenario": scenario, "reference": reference})


class Search:
    """The search for the smallest candidate."""

    def __init__(self, replays: Replays, notice: Notice = lambda replays, best: None) -> None:
        self._replays, self._notice = replays, notice
        self.first = self._best = replays.first
        self.complete = False
        self.reductions = Reductions(replays.fixed, replays.met, replays.tracks)

    def smallest(self) -> Candidate:
        """The smallest candidate found."""
        with contextlib.suppress(_Enough):
            passes = self.reductions.passes
            found = smallest(self.first, self._holds, passes, lambda one: one.cost)
            self.complete = found == self._best
        return self._best

    def _holds(self, candidate: Candidate) -> bool:
        """Whether a candidate fails as the recorded episode did; it is then the best so far."""
        if not self._replays.fails_the_same(candidate):
            return False
        self._best = candidate
        self._notice(self._replays.played, candidate)
        return True
