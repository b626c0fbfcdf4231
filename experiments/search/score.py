"""How many faulty drivers a tester fails preventably, and how soon.

    python experiments/search/score.py --method portfolio --method timing --seeds 3

Every driver of ``faulty_drivers.py`` is tested on its own, without traffic, by so many episodes; a
search begins anew for each. The careful driver must not be failed by anybody.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

HERE = Path(__file__).parent
AGENTS = ("timing", "proximity", "programmed-random", "random", "best-response")


class Trial(NamedTuple):
    """One driver, one tester, one seed.

    Attributes:
        driver, method: who was tested by whom.
        failures, unpreventable: how many preventable failures there were, and how many others.
        first: the episode of the first preventable one, from 1; None for none.
        seconds: simulated time of all episodes [s].
    """

    driver: str
    method: str
    failures: int
    unpreventable: int
    first: int | None
    seconds: float


def tried(driver: str, method: str, seed: int, options: argparse.Namespace) -> Trial:
    """Test one driver."""
    import cavsumo

    agent = method if method in AGENTS else "search"
    params = {} if method in AGENTS else {"search.method": method}
    results = cavsumo.run(
        options.net,
        routes="none",
        ego=f"faulty_drivers:{driver}",
        agents=[agent],
        params=params,
        testers=options.testers,
        runs=options.episodes,
        seed=seed,
        trace="none",
        jobs=options.jobs,
        progress=False,
    )
    table = results.rows
    failed = table["outcome"] == "violated"
    preventable = failed & (table["avoidable"] == 1)
    first = int(preventable.to_numpy().argmax()) + 1 if preventable.any() else None
    others = int(failed.sum() - preventable.sum())
    seconds = float(table["time_s"].sum())
    return Trial(driver, method, int(preventable.sum()), others, first, seconds)


def lines(trials: Sequence[Trial], methods: Sequence[str], seeds: int) -> Iterator[str]:
    """The table: a line for each driver, a column for each method."""
    from cavsumo.results.statistics import rate

    yield "driver".ljust(24) + "".join(method.rjust(22) for method in methods)
    drivers = list(dict.fromkeys(trial.driver for trial in trials))
    for driver in drivers:
        cells = []
        for method in methods:
            own = [t for t in trials if (t.driver, t.method) == (driver, method)]
            firsts = [t.first for t in own if t.first is not None]
            when = f", first {median(firsts):g}" if firsts else ""
            cells.append(f"{len(firsts)} of {seeds}{when}".rjust(22))
        yield driver.ljust(24) + "".join(cells)
    for method in methods:
        own = [t for t in trials if t.method == method and t.driver != "Careful"]
        found = rate(sum(t.first is not None for t in own), len(own))
        yield (
            f"{method}: {found.count} of {found.total} trials failed a faulty driver, "
            f"{found.value:.0%} [{found.low:.0%}, {found.high:.0%}]; "
            f"{sum(t.failures for t in own)} preventable and "
            f"{sum(t.unpreventable for t in own)} other failures in "
            f"{sum(t.seconds for t in own):.0f} simulated seconds"
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--method", action="append", default=[], help="of the search, or an agent")
    parser.add_argument("--driver", action="append", default=[], help="by default all")
    parser.add_argument("--net", default="crossing")
    parser.add_argument("--testers", type=int, default=1)
    parser.add_argument("--episodes", type=int, default=150)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("-j", "--jobs", type=int, default=2)
    options = parser.parse_args()
    sys.path.insert(0, str(HERE))
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    from faulty_drivers import FAULTS

    methods = options.method or ["portfolio", "timing"]
    drivers = options.driver or ["Careful", *FAULTS]
    trials = []
    for driver in drivers:
        for method in methods:
            for seed in range(1, options.seeds + 1):
                trials.append(tried(driver, method, seed, options))
                print(trials[-1], file=sys.stderr, flush=True)
    print("\n".join(lines(trials, methods, options.seeds)))


if __name__ == "__main__":
    main()
