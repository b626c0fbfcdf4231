"""Kept tests against another ego: does it still fail, does it pass now, or does it meet nobody?

The testers do what was recorded, or set off when the ego is where it was when they set off. The
assertion ``standing`` is asserted too, so the episode goes on after a passed test until the ego has
arrived or the time is over, and an ego that stops for ever is not taken for one that copes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.agents.recorded import Hold, Recorded
from cavsumo.assertions.judgement import HELD, VIOLATED
from cavsumo.batch.executors import local_executor
from cavsumo.batch.jobs import Job
from cavsumo.batch.playback import AGAIN, for_playback, recording_of
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.trust import check_trust
from cavsumo.batch.worker import play
from cavsumo.errors import InputError, UnknownName
from cavsumo.kept.cavtest import KeptTest, read_cavtest
from cavsumo.kept.standing import has_reason_to_stand
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.scenario import Params
from cavsumo.results.rows import Outcome, cell, verdicts_of
from cavsumo.results.traces import Trace, last_stood, trace_of

STANDING = "standing"  # the assertion that tells an ego that stops for ever
FAILS, PASSES, ELSEWHERE = "still fails", "passes now", "no longer meets"
STANDS, ERROR = "stands still", "error"
STATUSES = (FAILS, STANDS, ELSEWHERE, PASSES, ERROR)
RECORDED, POLICY = "recorded", "policy"  # what the testers follow
TESTERS = (RECORDED, POLICY)
STOOD = "stood"  # in the column ``frozen``


@dataclass(frozen=True)
class Regression:
    """Result of a kept test against an ego.

    Attributes:
        file: of the test.
        sentence: the test in words.
        status: one of STATUSES.
        told: why, in words.
        row: of the episode, as text.
    """

    file: Path
    sentence: str
    status: str
    told: str
    row: Mapping[str, str]


@dataclass(frozen=True)
class OtherEgo:
    """An ego to which tests are given.

    Attributes:
        name: as for ``run --ego``.
        params: its parameters.
        testers: RECORDED or POLICY.
        trust: use egos and assertions that only the files name.
    """

    name: str
    params: Params = dataclasses.field(default_factory=dict)
    testers: str = RECORDED
    trust: bool = False

    def __post_init__(self) -> None:
        if self.testers not in TESTERS:
            raise UnknownName("choice of --testers", self.testers, TESTERS)

    @property
    def allowed(self) -> Collection[str] | None:
        """The external names that a test may use."""
        return None if self.trust else (self.name,)


@dataclass(frozen=True)
class _Prepared:
    """A test that is about to be played."""

    test: KeptTest
    batch: PreparedBatch
    job: Job


def regressions(
    files: Sequence[Path],
    ego: OtherEgo,
    jobs: int = 1,
    notice: Callable[[int], None] = lambda done: None,
) -> list[Regression]:
    """The results of kept tests against an ego, in the order of the files.

    Args:
        jobs: tests at a time.
        notice: called with the number of tests played so far.

    Raises InputError for a file that is no kept test, and for an ego that is not there; then no
    test is played.
    """
    prepared = [_prepared(file, ego) for file in files]
    found: list[Regression] = []
    with local_executor(jobs) as executor:
        asked = [executor.submit(play, one.batch, one.job) for one in prepared]
        for one, answer in zip(prepared, asked, strict=True):
            found.append(_told(one, answer.result().outcome))
            notice(len(found))
    return found


def _prepared(file: Path, ego: OtherEgo) -> _Prepared:
    """A test with the new ego in place of its own."""
    test = read_cavtest(file, ego.allowed)
    there = for_playback(test.record)
    scenario = there.plan.scenario
    if scenario.script is not None:
        raise InputError(f"test {str(file)!r}: is a case of a suite; play the suite")
    asserted = tuple(dict.fromkeys((*scenario.assertions, STANDING)))
    update: dict[str, Any] = {"ego": ego.name, "ego_params": dict(ego.params)}
    scenario = scenario.model_copy(update={**update, "assertions": asserted})
    check_trust(scenario, file, ego.allowed)
    plan = there.plan.model_copy(
        update={"scenario": scenario, "reference": test.record.plan.reference}
    )
    batch = prepare(plan)
    assert test.record.trace is not None
    recorded = recording_of(test.record, test.record.trace)
    if ego.testers == POLICY:
        recorded = _holding(recorded, test.record.trace, batch.site.route.path)
    job = Job(there.run, AGAIN, recorded.seed, record=True, recorded=recorded, briefly=True)
    return _Prepared(test, batch, job)


def _holding(recorded: Recorded, trace: Trace, path: Polyline) -> Recorded:
    """A recording whose testers set off when the ego is where it was as they last stood.

    ``path``: of the new ego.
    """
    frames = trace.frames
    along = [path.project(frame["ego"][0], frame["ego"][1]).along for frame in frames]
    holds = []
    for name in frames[0]["testers"]:
        stood = last_stood(frame["testers"][name][2] for frame in frames)
        holds.append(None if stood is None else Hold(stood, along[stood]))
    return dataclasses.replace(recorded, holds=holds)


def _told(one: _Prepared, outcome: Outcome) -> Regression:
    """The result of a test from its episode."""
    record, trace = one.test.record, trace_of(outcome)
    row = {name: cell(value) for name, value in outcome.row.items()}
    stands = False
    if trace is not None and row["frozen"] == STOOD:
        stands = not has_reason_to_stand(trace, one.batch.site)
    status, told = judged(record.row, row, stands=stands)
    return Regression(record.file, one.test.sentence, status, told, row)


def judged(was: Mapping[str, str], row: Mapping[str, str], *, stands: bool) -> tuple[str, str]:
    """The status of a test, and why.

    Args:
        was: the row of the test.
        row: that of the same test with another ego.
        stands: whether the ego stood for long at the end, without a reason.
    """
    if row["outcome"] == "error":
        return ERROR, row["error"]
    said = verdicts_of(row)
    verdict, name = said.get(was["assertion"], row["outcome"]), was["assertion"]
    if verdict == VIOLATED:
        return FAILS, _violated(row, name)
    if row["outcome"] == "invalid" and _time_of(row["breach"]) <= float(was["time_s"]):
        return ELSEWHERE, f"a tester broke a rule of the world: {row['breach']}"
    if stands or (said.get(STANDING) == VIOLATED and name != STANDING):
        return STANDS, "the ego stands without reason and does not drive on"
    if verdict == HELD:
        return PASSES, f"{name} was triggered by {row['tester'] or 'the situation'} and held"
    return ELSEWHERE, f"{name}: {verdict.replace('_', ' ')}"


def _time_of(breach: str) -> float:
    """The time of a breach [s]; one after the end of the record, when bodies go on, is none."""
    return float(breach.rpartition(" at ")[2].removesuffix(" s"))


def _violated(row: Mapping[str, str], name: str) -> str:
    """The failure in words."""
    if row["assertion"] != name:  # the row tells of another one, which was violated before
        return f"{name} was violated"
    who, when = row["tester"] or "nobody", row["violation_time_s"]
    speed = row["impact_speed_mps"]
    impact = f", closing at {float(speed):.1f} m/s" if speed else ""
    kind = {"1": ", preventable", "0": ", unpreventable"}.get(row["avoidable"], "")
    return f"{name} was violated at {when} s with {who}{impact}{kind}"


def counts(found: Sequence[Regression]) -> dict[str, int]:
    """How many tests have each status."""
    return {status: sum(one.status == status for one in found) for status in STATUSES}


def lines(found: Sequence[Regression]) -> Iterator[str]:
    """A line for each test, and one for all of them."""
    width = max((len(str(one.file)) for one in found), default=0)
    for one in found:
        yield f"{one.file!s:<{width}}  {one.status:<15}  {one.told}"
    yield ", ".join(f"{status}: {count}" for status, count in counts(found).items() if count)
