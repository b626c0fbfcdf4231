"""cavsumo beside CAV-Gym on the straight road, and the timing tester beside what can be forced.

    python benchmarks/cav_gym.py [--runs 250] [--timing-runs 1000]

CAV-Gym's own figures (github.com/TSL-UOB/CAV-Gym, its pedestrians environment at 60 Hz, 250
episodes a cell, 95 % Wilson intervals) are the ones to overlap. SUMO's clock counts milliseconds,
so this runs at 50 Hz; epsilon 0.01 per step at 60 Hz is 0.603 per second.

A start can be forced when a pedestrian, turned at full steering to some heading between 20 and 160
degrees against the road and walking on, enters the strip that the ego sweeps before the braking
zone arrives there. It is a grid over straight ways, not a proof for all others.
"""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path

import numpy as np

from cavsumo.agents.walking import steer_to
from cavsumo.batch.dispatch import run_batch
from cavsumo.batch.executors import local_executor
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.batch.summary import interval, percent
from cavsumo.batch.tally import Tally
from cavsumo.model.bodies import PEDESTRIAN, Body
from cavsumo.model.carriageway import Start
from cavsumo.model.geometry import Box, overlap
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.snapshot import BodyState
from cavsumo.model.stopping_zones import zone_entered
from cavsumo.network.pedestrian_starts import draw_starts
from cavsumo.network.site import Site
from cavsumo.results.rows import is_test
from cavsumo.results.statistics import Rate, rate

ROOT = Path(__file__).resolve().parent.parent
SETTINGS = {
    "net": str(ROOT / "networks" / "pedestrians.net.xml"),
    "routes": "none",
    "ego": "constant",
    "ego_params": {"speed": 6.75},
    "step_length": 0.02,
    "end": 16.66,
    "trace": "none",
    "params": {"rate_per_s": 0.603, "random.between": "repeat", "election.rule": "unsigned"},
}
AGENTS = ("random", "programmed-random", "proximity", "election")
THEIRS = {"programmed-random": "constrained random"}  # where they call it otherwise


def main() -> None:
    """Measure and print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=250)
    parser.add_argument("--timing-runs", type=int, default=1000)
    options = parser.parse_args()
    if options.runs:
        compare(options.runs)
    if options.timing_runs:
        force(options.timing_runs)


def compare(runs: int) -> None:
    """The four testers beside CAV-Gym's."""
    measured = cav_gym()
    print(f"{'tester':18}  n  {'cavsumo, 95 %':>22}   unfair  {'CAV-Gym, 95 %':>22}  overlap")
    for testers in (1, 3, 6):
        rows = play(testers, AGENTS, runs)
        for agent in AGENTS:
            mine = [r for r in rows if r["agent"] == agent]
            found = rate_of_tests(mine)
            unfair = sum(r["outcome"] == "unfair" for r in mine)
            theirs, low, high = measured[THEIRS.get(agent, agent), testers]
            print(
                f"{agent:18} {testers:2}  {percent(found.value):>7} {interval(found):>14}  "
                f"{unfair:3}/{runs}  {theirs:6.1f} %  {f'[{low:.1f}, {high:.1f}]':>13}  "
                f"{'yes' if found.overlaps(low / 100, high / 100) else 'NO'}"
            )


def cav_gym() -> dict[tuple[str, int], tuple[float, float, float]]:
    """CAV-Gym by tester and number of pedestrians: interesting % with 95 % Wilson interval."""
    with (ROOT / "experiments" / "peers.csv").open(encoding="utf-8", newline="") as stream:
        return {
            (row["tester"], int(row["testers"])): (
                float(row["percent"]),
                float(row["low"]),
                float(row["high"]),
            )
            for row in csv.DictReader(stream)
            if row["source"] == "re-measured"
        }


def force(runs: int) -> None:
    """The timing tester beside the starts that can be forced, start by start."""
    print(f"\n{'timing':>9}  {'tests, 95 %':>22}  unfair  forceable  won of them  of the bound")
    for testers in (1, 3, 6):
        count = runs if testers == 1 else runs // 2
        made = prepared(testers, ("timing",), count)
        possible = [forceable_episode(made.plan, made.site, run) for run in range(count)]
        rows = play(testers, ("timing",), count)
        found, bound = rate_of_tests(rows), rate(sum(possible), count)
        unfair = sum(r["outcome"] == "unfair" for r in rows)
        won = sum(p and is_test(r) for r, p in zip(rows, possible, strict=True))
        print(
            f"{testers:>9}  {percent(found.value):>7} {interval(found):>14}  {unfair:6}  "
            f"{percent(bound.value):>9}  {percent(won / bound.count):>11}  "
            f"{found.count / bound.count:12.3f}"
        )


def prepared(testers: int, agents: tuple[str, ...], runs: int) -> PreparedBatch:
    """The plan of a cell, ready to be played."""
    known = {"timing": {}, **dict.fromkeys(AGENTS, SETTINGS["params"])}
    params = known[agents[0]]
    plan = plan_from(
        SETTINGS | {"testers": testers, "agents": agents, "runs": runs, "params": params}, "cav_gym"
    )
    return prepare(plan)


def play(testers: int, agents: tuple[str, ...], runs: int) -> list[dict[str, object]]:
    """The rows of a cell."""
    made = prepared(testers, agents, runs)
    with local_executor(2) as executor:
        return [answer.outcome.row for answer in run_batch(made, executor, made.plan.todo())]


def rate_of_tests(rows: list[dict[str, object]]) -> Rate:
    """The tests among valid episodes."""
    tally = Tally()
    tally.add_rows(rows)
    return tally.all.rate("tests")


def forceable_episode(plan: BatchPlan, site: Site, run: int) -> bool:
    """Whether any of an episode's starts can be forced."""
    seed = job(plan, run).seed
    stream = np.random.default_rng(np.random.SeedSequence(seed).spawn(1)[0])
    starts = draw_starts(site.areas, [PEDESTRIAN] * plan.scenario.testers, stream)
    return any(forceable(start) for start in starts)


def forceable(start: Start) -> bool:
    """Whether some heading brings a pedestrian into the ego's strip in time."""
    lane, up = -1.825, 1.0 if start.y < 0 else -1.0
    return any(
        in_time(start, up * math.radians(degrees), lane) for degrees in range(90, 165, 5)
    ) or any(in_time(start, up * math.radians(degrees), lane) for degrees in range(20, 90, 5))


def in_time(
    start: Start, heading: float, lane: float, v_ego: float = 6.75, dt: float = 0.02
) -> bool:
    """Walk one way until the box touches the strip; whether the braking zone is not there yet."""
    kind, body, v_ego, dt = PEDESTRIAN, Body("walker", PEDESTRIAN), 6.75, 0.02
    strip = Box(49.5, lane, 0.0, 400.0, 1.75)
    state = BodyState(body, start.x, start.y, kind.v_max, start.o)
    for k in range(round(16.66 / dt)):
        steering = steer_to(state, heading, dt)
        moved = step_floats(*state[1:], 0.0, steering, kind.wheelbase, kind.v_min, kind.v_max, dt)
        state = BodyState(body, *moved)
        if overlap(state.box, strip):
            ego = Box(v_ego * dt * (k + 1), lane, 0.0, 4.5, 1.75)
            zone = zone_entered(
                state.box, ego, v_ego, max_decel=9.0, reaction_time=0.675, wheelbase=3.0
            )
            return zone in (None, "reaction") and state.x > ego.x and state.x <= 99.0
    return False


if __name__ == "__main__":
    main()
