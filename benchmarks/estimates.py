"""Estimators in SUMO against plain Monte Carlo, under one exposure.

The truth is a long run of Monte Carlo with its exact interval. Then each estimator is played many
times from other seeds: its mean, how many results were refused, how often the interval meets that
of the truth (it contains the truth itself only as well as that is known), and the gain, which is
the variance of as many episodes of Monte Carlo over that of the estimates.

With ``--estimates FILE`` each estimate is kept there, a line of JSON, and one that is there already
is not played again; several processes may share the work by ``--first``.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import cavsumo
from cavsumo.agents.names import ESTIMATE_METHODS
from cavsumo.probability.monte_carlo import exact_estimate

NEVER = 1e-6  # a half-width that is not reached
TRUTH_SEED, FIRST_SEED = 1, 1001
MONTE_CARLO = "monte-carlo"


class Truth(NamedTuple):
    """A long run of Monte Carlo.

    Attributes:
        episodes: how many were played.
        simulated_s: in how much simulated time [s].
        failures: how many failed.
        failed: which, from 0, for a kept run; None for one that was just played.
    """

    episodes: int
    simulated_s: float
    failures: int
    failed: tuple[int, ...] | None = None


def main() -> None:
    """Print the truth and one row an estimator."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--net", default="crossing")
    parser.add_argument("--ego", default="sumo")
    parser.add_argument("--exposure", help="a TOML file; without it the default")
    parser.add_argument("--truth", type=int, default=100_000, help="episodes")
    parser.add_argument("--kept", help="a file of benchmarks/truth, in place of playing the truth")
    parser.add_argument("--replications", type=int, default=50)
    parser.add_argument("--first", type=int, default=FIRST_SEED, help="seed of the first one")
    parser.add_argument("--estimates", type=Path, help="a file that keeps them")
    parser.add_argument("--episodes", type=int, default=2000, help="of an estimate")
    parser.add_argument("--method", action="append", choices=ESTIMATE_METHODS)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    truth = _truth(asked)
    exact = exact_estimate(truth.failures, truth.episodes, 0.05, 0.95)
    print(
        f"truth: {exact.failures} failures in {truth.episodes} episodes of "
        f"{truth.simulated_s / truth.episodes:.1f} s: {exact.p:.3g} "
        f"[{exact.lower:.3g}, {exact.upper:.3g}]"
    )
    print("method       mean/p  rel. sd  refused  meets  gain  said")
    for method in asked.method or ESTIMATE_METHODS:
        if method == MONTE_CARLO and truth.failed is not None:
            found = _blocks(truth, asked.episodes)[: asked.replications]
        else:
            seeds = range(asked.first, asked.first + asked.replications)
            found = [_replication(asked, method, seed) for seed in seeds]
        print(_row(method, found, exact.p, (exact.lower, exact.upper), asked.episodes), flush=True)


def _truth(asked: argparse.Namespace) -> Truth:
    """The long run: kept, or played now."""
    if asked.kept is None:
        found = _estimated(asked, MONTE_CARLO, asked.truth, TRUTH_SEED)
        return Truth(asked.truth, found["simulated_s"], found["failures"])
    kept = json.loads(Path(asked.kept).read_text(encoding="utf-8"))
    given = {"net": Path(asked.net).name.removesuffix(".net.xml"), "ego": asked.ego}
    for key, value in given.items():
        if kept[key] != value:
            raise SystemExit(f"{asked.kept}: is of {key} {kept[key]}, not {value}")
    failed = tuple(kept["failed"])
    return Truth(kept["episodes"], kept["simulated_s"], len(failed), failed)


def _blocks(truth: Truth, episodes: int) -> list[dict[str, Any]]:
    """Estimates of Monte Carlo from parts of a kept run."""
    found = []
    for begin in range(0, truth.episodes - episodes + 1, episodes):
        failures = sum(begin <= run < begin + episodes for run in truth.failed or ())
        one = exact_estimate(failures, episodes, 0.05, 0.95)
        found.append(
            {
                "refused": None,
                "lower": one.lower,
                "upper": one.upper,
                "looks": [{"p": one.p}],
                "gain": {"value": 1.0},
            }
        )
    return found


def _replication(asked: argparse.Namespace, method: str, seed: int) -> dict[str, Any]:
    """One estimate, from the file that keeps them if it is there."""
    key = {"net": Path(asked.net).name, "ego": asked.ego, "method": method,
           "episodes": asked.episodes, "seed": seed}  # fmt: skip
    file: Path | None = asked.estimates
    if file is not None and file.exists():
        for line in file.read_text(encoding="utf-8").splitlines():
            kept = json.loads(line)
            if kept["key"] == key:
                return dict(kept["found"])
    found = _estimated(asked, method, asked.episodes, seed)
    if file is not None:
        with file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps({"key": key, "found": found}) + "\n")
    return found


def _estimated(asked: argparse.Namespace, method: str, episodes: int, seed: int) -> dict[str, Any]:
    """One estimate of all its episodes, as the command prints it."""
    found = cavsumo.estimate(
        asked.net,
        ego=asked.ego,
        routes="none",
        exposure=asked.exposure,
        method=method,
        half_width=NEVER,
        max_episodes=episodes,
        seed=seed,
        jobs=asked.jobs,
        trace="none",
        progress=False,
    )
    return dict(found.facts)


def _row(method: str, found: list, p: float, truth: tuple[float, float], episodes: int) -> str:
    """The row of a method."""
    kept = [one for one in found if one["refused"] is None]
    estimates = np.array([one["looks"][-1]["p"] for one in found])
    meets = [one["lower"] <= truth[1] and truth[0] <= one["upper"] for one in kept]
    spread = float(estimates.std(ddof=1)) if len(found) > 1 else math.nan
    gain = p * (1 - p) / episodes / spread**2 if spread else math.nan
    said = [one["gain"]["value"] for one in kept if one["gain"]["value"] is not None]
    mean, relative = (x / p if p else math.nan for x in (estimates.mean(), spread))
    return (
        f"{method:11}  {mean:6.2f}  {relative:7.2f}  {len(found) - len(kept):7}  "
        f"{np.mean(meets) if meets else math.nan:5.2f}  {gain:4.1f}  "
        f"{np.median(said) if said else math.nan:4.1f}"
    )


if __name__ == "__main__":
    main()
