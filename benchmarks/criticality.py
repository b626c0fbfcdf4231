"""What measuring TTC, DRAC and PET costs, as a share of the processor time of an episode.

    python benchmarks/criticality.py [--episodes N]

Episodes of timing on each of the networks; each share is of the same episodes.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cavsumo.assertions import criticality_monitor
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.model.scenario import plan_from

NETWORKS = Path(__file__).resolve().parent.parent / "networks"
PARTS = {
    "TTC and DRAC": ("converging", "_smallest_ttc", "_largest_drac"),
    "PET": ("_smallest_pet",),
}


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=25)
    episodes = parser.parse_args().episodes
    spent = Counter[str]()
    for part, names in PARTS.items():
        for name in names:
            setattr(
                criticality_monitor, name, timed(getattr(criticality_monitor, name), part, spent)
            )
    print(f"{'':12}", *(f"{part:>13}" for part in PARTS), "  ms an episode")
    for network in ("crossing", "junction", "pedestrians"):
        net = NETWORKS / f"{network}.net.xml"
        settings = {"net": net, "runs": episodes, "trace": "none", "reference": "none"}
        plan = plan_from(settings, "benchmark")
        with EpisodeRunner(prepare(plan)) as runner:
            runner.play(job(plan, 0))
            spent.clear()
            begun = time.process_time()
            for run in range(episodes):
                runner.play(job(plan, run))
            whole = time.process_time() - begun
        shares = (f"{100 * spent[part] / whole:11.2f} %" for part in PARTS)
        print(f"{network:12}", *shares, f"{1e3 * whole / episodes:15.1f}")


def timed(function: Callable[..., Any], part: str, spent: Counter[str]) -> Callable[..., Any]:
    """The function, whose processor time is added up."""

    def measured(*args: Any) -> Any:
        begun = time.process_time()
        found = function(*args)
        spent[part] += time.process_time() - begun  # type: ignore[assignment]
        return found

    return measured


if __name__ == "__main__":
    main()
