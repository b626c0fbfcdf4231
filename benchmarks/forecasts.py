"""What the tester expectiminimax says of an episode beforehand, beside what comes out.

    python benchmarks/forecasts.py [--runs 200] [--timing-runs 200] [-j 1]

The straight road of CAV-Gym, one pedestrian, an ego that keeps its speed (settings and bound are
those of ``cav_gym.py``). A forecast is right when a start said to be sure ends in a test, and one
said to be not forceable does not. The timing tester plays the first of the same starts.
"""

from __future__ import annotations

import argparse
from collections import Counter

import cav_gym

from cavsumo.batch.dispatch import run_batch
from cavsumo.batch.executors import local_executor
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.summary import interval, percent
from cavsumo.model.scenario import plan_from
from cavsumo.results.columns import Row
from cavsumo.results.rows import is_test
from cavsumo.results.statistics import rate


def main() -> None:
    """Play, count, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=200)
    parser.add_argument("--timing-runs", type=int, default=200)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    options = parser.parse_args()
    made = prepared("expectiminimax", options.runs, {"against": "constant"})
    rows = play(made, options.jobs)
    possible = [cav_gym.forceable_episode(made.plan, made.site, run) for run in range(options.runs)]
    table(rows, possible)
    if options.timing_runs:
        theirs = play(prepared("timing", options.timing_runs, {}), options.jobs)
        both = list(zip(theirs, rows, strict=False))
        print(
            f"tests in the first {len(both)} starts: timing {sum(is_test(a) for a, _ in both)}, "
            f"expectiminimax {sum(is_test(b) for _, b in both)}"
        )


def prepared(agent: str, runs: int, params: dict[str, str]) -> PreparedBatch:
    """The plan of one agent, ready to be played."""
    own = {"testers": 1, "agents": (agent,), "runs": runs, "params": params, "reference": "none"}
    return prepare(plan_from(cav_gym.SETTINGS | own, "forecasts"))


def play(made: PreparedBatch, jobs: int) -> list[Row]:
    """The rows of a batch."""
    with local_executor(jobs) as executor:
        return [answer.outcome.row for answer in run_batch(made, executor, made.plan.todo())]


def table(rows: list[Row], possible: list[bool]) -> None:
    """Forecasts against outcomes and against the bound."""
    print(f"{'forecast':14}  starts  tests  unfair  errors  in the bound")
    for verdict in ("sure", "undecided", "not-forceable"):
        mine = [(r, b) for r, b in zip(rows, possible, strict=True) if r["forecast"] == verdict]
        outcomes = Counter(r["outcome"] for r, _ in mine)
        tests, bound = sum(is_test(r) for r, _ in mine), sum(b for _, b in mine)
        print(
            f"{verdict:14}  {len(mine):6}  {tests:5}  {outcomes['unfair']:6}  "
            f"{outcomes['error']:6}  {bound:12}"
        )
    said = {"sure": True, "not-forceable": False}
    right = sum(said.get(r["forecast"]) is is_test(r) for r in rows)
    agree = sum(said.get(r["forecast"]) is b for r, b in zip(rows, possible, strict=True))
    tests, bound = rate(sum(map(is_test, rows)), len(rows)), rate(sum(possible), len(rows))
    print(f"right: {right} of {len(rows)}; agree with the bound: {agree}")
    print(f"tests {percent(tests.value)} {interval(tests)}, forceable {percent(bound.value)}")


if __name__ == "__main__":
    main()
