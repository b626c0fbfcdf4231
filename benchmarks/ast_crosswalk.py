"""The failure probability of the suite ``ast-crosswalk`` by plain Monte Carlo.

    python benchmarks/ast_crosswalk.py [--episodes 1000000] [--sumo 200] [--seed 1]

``model``: the reference dynamics (``cavsumo/model/crosswalk.py``), with a Clopper-Pearson interval
of 95 %. ``in SUMO``: the suite's draws from 1 on, as it plays them, and how many of these draws
both judge alike. The draws of the first column come from the seed, not from the suite.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

import cavsumo
from cavsumo.model.crosswalk import DEVIATIONS, STARTS, STEPS, CrosswalkStart, failures, normals
from cavsumo.results.statistics import Rate, rate

AT_ONCE = 20_000  # episodes, so that the memory is bounded


def main() -> None:
    """Print a line for each starting point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name, default in (("episodes", 1_000_000), ("sumo", 200), ("seed", 1)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    print(f"{'start':9}{'y, walk':>16}  {'model':48}in SUMO")
    for i, start in enumerate(STARTS):
        found = monte_carlo(start, options.episodes, np.random.default_rng((options.seed, i)))
        there = f"{start.y_m:g} m, {start.walk_mps:g} m/s"
        print(f"start-{i + 1:<3}{there:>16}  {told(found):48}{played(i, options.sumo)}", flush=True)


def monte_carlo(start: CrosswalkStart, episodes: int, rng: np.random.Generator) -> Rate:
    """The share of failures among episodes with independent random vectors."""
    count = 0
    for done in range(0, episodes, AT_ONCE):
        size = min(AT_ONCE, episodes - done), STEPS, len(DEVIATIONS)
        count += int(failures(start, rng.standard_normal(size)).sum())
    return rate(count, episodes, "exact")


def told(found: Rate) -> str:
    """A rate with its interval."""
    return f"{found.value:.3g} [{found.low:.3g}, {found.high:.3g}], {found.count} of {found.total}"


def played(i: int, draws: int) -> str:
    """The same starting point in SUMO: its share of failures, and agreement with the model."""
    if not draws:
        return ""
    how: dict[str, Any] = {"jobs": 1, "progress": False, "trace": "none"}
    names = [f"start-{i + 1}/{draw}" for draw in range(1, draws + 1)]
    rows = cavsumo.suite("ast-crosswalk", "crosswalk", only=names, **how).rows
    failed = (rows["outcome"] == "violated").to_numpy()
    model = [bool(failures(STARTS[i], normals(draw))[0]) for draw in range(1, draws + 1)]
    alike = int((failed == np.array(model)).sum())
    return f"{told(rate(int(failed.sum()), draws, 'exact'))}; alike {alike}"


if __name__ == "__main__":
    main()
