"""How many faulty drivers a tester fails preventably, and how soon.

    python experiments/search/score.py --method portfolio --method timing --seed 1 2 -o some.jsonl
    python experiments/search/score.py --read some.jsonl more.jsonl

Every driver of ``faulty_drivers.py`` (or, with ``--drivers other_drivers``, of that module) is
tested on its own, without traffic, by so many episodes; a search begins anew for each. A driver
whose fault needs two pedestrians meets two, whoever tests it. A careful driver must not be failed
by anybody. Trials are kept one a line, so a table can be made in parts; trials that are in the file
already are not played again.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import resource
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

HERE = Path(__file__).parent
AGENTS = ("timing", "proximity", "programmed-random", "random", "best-response")
CAREFUL = ("Careful", "Cautious")  # of the two modules


class Trial(NamedTuple):
    """One driver, one tester, one seed.

    Attributes:
        driver, method, seed, net, testers, episodes: who was tested by whom, and how.
        failures, unpreventable: how many preventable failures there were, and how many others.
        unfair, invalid: how many episodes were.
        first: the episode of the first preventable one, from 1; None for none.
        seconds, cpu: simulated and processor time of all episodes [s].
    """

    driver: str
    method: str
    seed: int
    net: str
    testers: int
    episodes: int
    failures: int
    unpreventable: int
    unfair: int
    invalid: int
    first: int | None
    seconds: float
    cpu: float

    @property
    def key(self) -> tuple[object, ...]:
        """What was played."""
        return self[:6]


def tried(driver: str, method: str, seed: int, testers: int, options: argparse.Namespace) -> Trial:
    """Test one driver."""
    import cavsumo

    before, agent = _spent(), method if method in AGENTS else "search"
    results = cavsumo.run(
        options.net,
        routes="none",
        ego=f"{options.drivers}:{driver}",
        agents=[agent],
        params={} if method in AGENTS else {"search.method": method},
        testers=testers,
        runs=options.episodes,
        seed=seed,
        trace="none",
        jobs=options.jobs,
        progress=False,
    )
    table = results.rows
    failed, preventable = table["outcome"] == "violated", table["avoidable"] == 1
    preventable &= failed
    return Trial(
        driver,
        method,
        seed,
        options.net,
        testers,
        options.episodes,
        failures=int(preventable.sum()),
        unpreventable=int(failed.sum() - preventable.sum()),
        unfair=int((table["outcome"] == "unfair").sum()),
        invalid=int((table["outcome"] == "invalid").sum()),
        first=int(preventable.to_numpy().argmax()) + 1 if preventable.any() else None,
        seconds=round(float(table["time_s"].sum()), 1),
        cpu=round(_spent() - before, 2),
    )


def _spent() -> float:
    """Processor time of this process and of those that ended [s]."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in both)


def lines(trials: Sequence[Trial]) -> Iterator[str]:
    """The table: a line for each driver, a column for each method."""
    methods = list(dict.fromkeys(trial.method for trial in trials))
    yield "driver".ljust(24) + "".join(method.rjust(22) for method in methods)
    for driver in dict.fromkeys(trial.driver for trial in trials):
        cells = []
        for method in methods:
            own = [t for t in trials if (t.driver, t.method) == (driver, method)]
            firsts = [t.first for t in own if t.first is not None]
            when = f", first {median(firsts):g}" if firsts else ""
            cells.append(f"{len(firsts)} of {len(own)}{when}".rjust(22))
        yield driver.ljust(24) + "".join(cells)
    for method in methods:
        yield _summed(method, [t for t in trials if t.method == method])


def _summed(method: str, trials: Sequence[Trial]) -> str:
    """What a method reached, as a line."""
    from cavsumo.results.statistics import rate

    faulty = [t for t in trials if t.driver not in CAREFUL]
    careful = sum(t.failures for t in trials if t.driver in CAREFUL)
    found = rate(sum(t.first is not None for t in faulty), len(faulty))
    episodes = sum(t.episodes for t in faulty)
    wasted = sum(t.unfair + t.invalid for t in faulty) / max(1, episodes)
    seconds, cpu = (sum(getattr(t, what) for t in faulty) for what in ("seconds", "cpu"))
    failures = sum(t.failures for t in faulty)
    if not faulty:
        return f"{method}: the careful driver failed {careful} times"
    return (
        f"{method}: a faulty driver failed in {found.count} of {found.total} trials, "
        f"{found.value:.0%} [{found.low:.0%}, {found.high:.0%}], the careful one {careful} times; "
        f"{failures} preventable and {sum(t.unpreventable for t in faulty)} other failures, "
        f"{wasted:.0%} unfair or invalid, in {episodes} episodes, {seconds:.0f} simulated and "
        f"{cpu:.0f} CPU seconds: {1000.0 * failures / max(seconds, 1.0):.2f} per 1000 s"
    )


def read(files: Sequence[str]) -> list[Trial]:
    """The trials in some files; of those played twice the first."""
    found: dict[tuple[object, ...], Trial] = {}
    for file in files:
        if Path(file).exists():
            for text in Path(file).read_text(encoding="utf-8").splitlines():
                trial = Trial(**json.loads(text))
                found.setdefault(trial.key, trial)
    return list(found.values())


def play(options: argparse.Namespace) -> list[Trial]:
    """Play what is asked for and not yet in the output file, to which it is added."""
    sys.path.insert(0, str(HERE))
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    there = importlib.import_module(options.drivers)
    known = {t.key: t for t in read([options.output] if options.output else [])}
    trials = []
    for driver in options.driver or [there.CAREFUL, *there.TESTERS]:
        testers = max(options.testers, there.TESTERS.get(driver, 1))
        for method in options.method or ["portfolio", "timing"]:
            for seed in options.seed:
                key = driver, method, seed, options.net, testers, options.episodes
                trial = known.get(key) or tried(driver, method, seed, testers, options)
                trials.append(trial)
                if key not in known and options.output:
                    with Path(options.output).open("a", encoding="utf-8") as file:
                        file.write(json.dumps(trial._asdict()) + "\n")
                print(trial, file=sys.stderr, flush=True)
    return trials


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--method", action="append", default=[], help="of the search, or an agent")
    parser.add_argument("--driver", action="append", default=[], help="by default all")
    parser.add_argument("--drivers", default="faulty_drivers", help="the module of the drivers")
    parser.add_argument("--net", default="crossing")
    parser.add_argument("--testers", type=int, default=1, help="at least so many")
    parser.add_argument("--episodes", type=int, default=150)
    parser.add_argument("--seed", type=int, nargs="+", default=list(range(1, 11)))
    parser.add_argument("-j", "--jobs", type=int, default=2)
    parser.add_argument("-o", "--output", help="add the trials to this file, one a line, as JSON")
    parser.add_argument("--read", nargs="+", help="play nothing: the table of trials in files")
    options = parser.parse_args()
    print("\n".join(lines(read(options.read) if options.read else play(options))))


if __name__ == "__main__":
    main()
