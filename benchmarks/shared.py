"""Searching in shared simulations, against the bare loop that restarts SUMO for every episode.

    python benchmarks/shared.py [--net FILE] [--testers N] [--agent NAME] [--blocks N]

Block by block, in turns: the bare loop of throughput.py (a restart and the same calls for every
episode), cavsumo with a simulation for each episode, cavsumo with one simulation for the block
(the search), and the tests that the search found once more in fresh ones (the confirmation).
Shared and fresh episodes of a seed differ where SUMO's drivers draw random numbers, so their
lengths do too: rates are per episode and per simulated timestep.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from collections import Counter
from pathlib import Path

from throughput import bare_loop, to_bare

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import Job, job
from cavsumo.batch.prepared import prepare
from cavsumo.model.scenario import SHARED_BY, plan_from
from cavsumo.results.rows import is_test
from cavsumo.simulation import loop

ROOT = Path(__file__).resolve().parent.parent


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", default=str(ROOT / "networks" / "crossing.net.xml"))
    parser.add_argument("--testers", type=int, default=1)
    parser.add_argument("--agent", default="random")
    parser.add_argument("--ego-param", action="append", default=[], metavar="KEY=NUMBER")
    parser.add_argument("--blocks", type=int, default=4)
    options = parser.parse_args()
    ego = {key: float(value) for key, _, value in (p.partition("=") for p in options.ego_param)}
    given = {"net": options.net, "testers": options.testers, "agents": (options.agent,)}
    plan = plan_from(
        given | {"trace": "none", "ego_params": ego, "runs": options.blocks * SHARED_BY}, "shared"
    )
    spent, steps, found, confirmed = Counter[str](), Counter[str](), 0, 0
    with EpisodeRunner(prepare(plan)) as runner:
        for block in range(options.blocks):
            jobs = [job(plan, block * SHARED_BY + i) for i in range(SHARED_BY)]
            bare(runner, jobs, spent, steps)
            play(runner, jobs, "fresh", spent, steps)
            shared = [dataclasses.replace(j, simulation="same" if i else "new")
                      for i, j in enumerate(jobs)]  # fmt: skip
            hits = play(runner, shared, "search", spent, steps)
            again = [j for j, hit in zip(jobs, hits, strict=True) if hit]
            found += len(again)
            confirmed += sum(play(runner, again, "confirmation", spent, steps))
    episodes = options.blocks * SHARED_BY
    print(f"{plan.scenario.name}, {options.agent}, {options.testers} testers, {episodes} episodes")
    for name in ("bare", "fresh", "search"):
        report(name, spent[name], spent["bare"], episodes, steps)
    both = spent["search"] + spent["confirmation"]
    print(
        f"{'search, confirmed':18} {episodes / both:7.1f} episodes/s  {spent['bare'] / both:5.2f}"
    )
    print(f"{found} tests found, {confirmed} confirmed, {found - confirmed} not")


def report(name: str, seconds: float, bare: float, episodes: int, steps: Counter[str]) -> None:
    """One line of the table."""
    us = 1e6 * seconds / steps[name]
    print(
        f"{name:18} {episodes / seconds:7.1f} episodes/s  {bare / seconds:5.2f}"
        f"  {steps[name] / episodes:6.1f} timesteps an episode, {us:6.1f} us each, all included"
    )


def bare(runner: EpisodeRunner, jobs: list[Job], spent: Counter[str], steps: Counter[str]) -> None:
    """The bare loop along the tracks of the fresh episodes."""
    for one in jobs:
        frames = loop.play(runner.setup, runner.agents_of(one), one.seed, record=True).frames
        tracks = [[to_bare(t) for t in s.testers] for s in frames]
        begun = time.perf_counter()
        bare_loop(runner.setup.world, one.seed, tracks)
        spent["bare"] += time.perf_counter() - begun  # type: ignore[assignment]
        steps["bare"] += len(tracks) - 1


def play(
    runner: EpisodeRunner, jobs: list[Job], name: str, spent: Counter[str], steps: Counter[str]
) -> list[bool]:
    """Play jobs; which of them were tests."""
    begun = time.perf_counter()
    rows = [runner.play(one).outcome.row for one in jobs]
    spent[name] += time.perf_counter() - begun  # type: ignore[assignment]
    steps[name] += sum(row["steps"] for row in rows)
    return [is_test(row) for row in rows]


if __name__ == "__main__":
    main()
