"""Failures made as small as they can be: how small, at which expense, and is nothing left to take?

Plays batches on several networks, with pedestrians and vehicles, with traffic, and minimises
preventable failures of each. Then, by force: every single reduction of some of the results is
played once more; and bodies that are irrelevant are planted in some of the records.

    python benchmarks/minimise.py --net crossing --net FILE.net.xml --failures 12 --force 10
"""

from __future__ import annotations

import argparse
import dataclasses
import statistics
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import cavsumo
from cavsumo.batch.playback import for_playback
from cavsumo.batch.replay import Record
from cavsumo.errors import CavsumoError
from cavsumo.kept.minimising import Minimised, Replays, minimised
from cavsumo.kept.reductions import Reductions

PLANTED = 50  # bodies
NETS = "crossing", "junction"
SETTINGS = {
    "pedestrians": {"agents": ["timing", "proximity"]},
    "cars": {"kind": "car", "agents": ["timing"]},
}


@dataclass(frozen=True)
class Case:
    """A failure and the smallest one to which it was reduced."""

    setting: str
    record: Record
    found: Minimised


def main() -> None:
    """Print the tables."""
    options = _parser().parse_args()
    print(f"{'':<26}{'failures':>9}{'one tester':>11}{'empty':>7}{'<= 2 legs':>10}{'all three':>10}"
          f"{'bodies':>12}{'segments':>12}{'seconds':>14}{'replays':>14}")  # fmt: skip
    cases: list[Case] = []
    with TemporaryDirectory() as folder:
        for net, kind in product(options.net or NETS, options.kind or SETTINGS):
            own = list(_cases(net, kind, options, Path(folder)))
            cases += own
            print(_line(named(net, kind), own), flush=True)
        print(_line("all", cases))
        chosen = cases[:: max(1, len(cases) // max(1, options.force))][: options.force]
        print(_force(chosen))
        print(_planted(cases[: options.planted]))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--failures", type=int, default=20, help="of each setting at most")
    parser.add_argument("--runs", type=int, default=150, help="episodes an agent of each setting")
    parser.add_argument("--force", type=int, default=10, help="results that are tried by force")
    parser.add_argument("--planted", type=int, default=5, help="records with planted bodies")
    parser.add_argument("--net", action="append", help=f"default: {', '.join(NETS)}")
    parser.add_argument("--kind", action="append", choices=SETTINGS, help="default: all")
    parser.add_argument("--seed", type=int, default=1)
    return parser


def named(net: str, kind: str) -> str:
    """The name of a setting."""
    return f"{Path(net).name.removesuffix('.net.xml')}, {kind}"


def _cases(net: str, kind: str, options: argparse.Namespace, folder: Path) -> Iterator[Case]:
    """Failures of a network and a kind of testers, made small."""
    name = named(net, kind)
    file = folder / f"{name.replace(', ', '-')}.csv"
    how = {"runs": options.runs, "seed": options.seed, "output": file, "progress": False}
    results = cavsumo.run(net, **SETTINGS[kind], **how)
    failures = results.failures
    runs = failures[failures["avoidable"] == 1]["run"].head(options.failures)
    for run in runs:
        record = results.replay(int(run), recorded=True).record
        try:
            yield Case(name, record, minimised(record, _same))
        except CavsumoError as error:
            print(f"{name}, run {run}: {error}")


def _same(record: Record) -> Record:
    """A record with all its files."""
    return record


def _line(name: str, cases: list[Case]) -> str:
    """The row of a table."""
    if not cases:
        return f"{name:<26}{0:>9}"
    last = [case.found.last for case in cases]
    alone = [len(one.motions) == 1 for one in last]
    empty = [not one.background for one in last]
    short = [one.segments <= 2 for one in last]
    every = [all(three) for three in zip(alone, empty, short, strict=True)]
    shares = "".join(f"{sum(one):>{width}}" for one, width in
                     ((alone, 11), (empty, 7), (short, 10), (every, 10)))  # fmt: skip
    return f"{name:<26}{len(cases):>9}{shares}{_sizes(cases)}"


def _sizes(cases: list[Case]) -> str:
    """Medians before and after, and the replays: median and most."""
    found = [case.found for case in cases]

    def medians(values: list[tuple[float, float]]) -> str:
        before, after = (statistics.median(column) for column in zip(*values, strict=True))
        return f"{before:g} to {after:g}"

    bodies = medians([(_bodies(one.first), _bodies(one.last)) for one in found])
    segments = medians([(one.first.segments, one.last.segments) for one in found])
    times = [(float(one.before.row["time_s"]), float(one.after.row["time_s"])) for one in found]
    replays = [one.replays for one in found]
    said = f"{statistics.median(replays):g}, {max(replays)}"
    return f"{bodies:>12}{segments:>12}{medians(times):>14}{said:>14}"


def _bodies(candidate: object) -> int:
    """How many bodies there are besides the ego."""
    return len(candidate.motions) + len(candidate.background)  # type: ignore[attr-defined]


def _force(cases: list[Case]) -> str:
    """Every single reduction of the results, played."""
    tried = fails = 0
    for case in cases:
        with Replays(for_playback(case.record), case.record, 10_000) as replays:
            assert replays.fails_the_same(case.found.last)
            reductions = Reductions(replays.fixed, replays.met, replays.tracks)
            for smaller in reductions.all(case.found.last):
                tried += 1
                fails += replays.fails_the_same(smaller)
    return f"by force: {fails} of {tried} single reductions of {len(cases)} results fail the same"


def _planted(cases: list[Case]) -> str:
    """Failures among pedestrians more, who walk elsewhere; where they still fail with them."""
    left = []
    for case in cases:
        record = _with_planted(case.record)
        if record is not None:
            found = minimised(record, _same)
            left.append(sum(one.id.startswith("planted") for one in found.last.background))
    gone = sum(count == 0 for count in left)
    return f"planted: {PLANTED} bodies in {len(left)} records; all of them gone in {gone}"


def _with_planted(record: Record) -> Record | None:
    """The record of a failure with pedestrians more; None where it is another episode with them.

    They walk as those of the background do, and depart one after the other until the violation.
    """
    with Replays(for_playback(record), record) as replays:
        first, end = replays.first, float(record.row["time_s"])
        walks = [
            first.walks[i % len(first.walks)]._replace(id=f"planted{i}", time=end * i / PLANTED)
            for i in range(PLANTED)
        ]
        more = dataclasses.replace(first, walks=(*first.walks, *walks))
        return replays.judged(more) if replays.fails_the_same(more) else None


if __name__ == "__main__":
    main()
