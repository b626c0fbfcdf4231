"""Solving games and MDPs beside Storm, in one run, to the same absolute precision.

    python benchmarks/games.py [--mdp COLUMNS ...] [--game COLUMNS ...] [--precision P]
                               [--rounds N] [--no-storm]

MDPs are those of ``rings.one_pedestrian`` (15 states a column), games those of
``rings.two_pedestrians`` (75 states a column). Both sides have one thread and begin with a model in
memory. cavsumo's seconds are those of ``solve`` on a game whose derived arrays are not yet made:
regions, solvability, order, policies, bounds and their check. Storm's are those of its model
checking: its own qualitative pass and its iteration. The rounds take turns; seconds and ratios
(of CPU seconds; of seconds on the clock) are medians over them. Sound value iteration has one
round. Compiled loops are loaded before the clock starts.

Models are built once: cavsumo's arrays by numpy from the rule, with all checks; Storm's states from
the same rule in Storm's own language. Storm has no solver for these games that answers through
Python, so it gets the MDPs alone.
"""

from __future__ import annotations

import argparse
import dataclasses
import importlib.util
import os
import resource
import statistics
import time
from collections.abc import Callable
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # one thread, as Storm; read when numpy is loaded

import numpy as np
import rings

from cavsumo.games import Game, solve


def main() -> None:
    """Print one line a problem."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--mdp", type=int, nargs="*", default=[680, 7172, 69064])
    parser.add_argument("--game", type=int, nargs="*", default=[138, 1440])
    parser.add_argument("--precision", type=float, default=1e-6)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--no-storm", action="store_true")
    options = parser.parse_args()
    storm = None
    if not options.no_storm and importlib.util.find_spec("stormpy"):
        import storm as bridge

        storm = bridge
    for small in (rings.two_pedestrians(50, 7), rings.one_pedestrian(2000)):
        solve(small)  # loads the compiled loops
    print(f"{'':4} {'states':>8} {'outcomes':>9}  {'built':>7}  {'cavsumo':>8}  {'width':>7}  "
          f"{'Storm: built':>12}  {'OVI':>8}  {'SVI':>8}  ratio of CPU, clock  agree")  # fmt: skip
    for columns in options.mdp:
        line("MDP", rings.one_pedestrian, columns, options, storm)
    for columns in options.game:
        line("game", lambda n: rings.two_pedestrians(n, 7), columns, options, None)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(f"memory at its peak, both together: {peak / 2**20:.1f} GB")


def line(kind: str, build: Callable[[int], Game], columns: int, options: Any, storm: Any) -> None:
    """Solve by all that can, in turns, and compare."""
    game, built = timed(lambda: build(columns))
    checked: Any = {}
    if storm:
        _, storm_built = timed(lambda: storm.ring(columns))
        model = storm.model(game, np.arange(game.n_cells))

        def check(method: str) -> Any:
            return storm.check(model, least=True, precision=options.precision, method=method)

        checked["sound"] = timed(lambda: check("sound"))
    ours, theirs = [], []
    for _ in range(options.rounds):
        fresh = dataclasses.replace(game)  # without what an earlier round derived
        found, spent = timed(lambda game=fresh: solve(game, precision=options.precision))
        ours.append(spent)
        if storm:
            checked["optimistic"] = timed(lambda: check("optimistic"))
            theirs.append(checked["optimistic"][1])
    seconds = statistics.median(clock for clock, _ in ours)
    said = ""
    if storm:
        said = f"  {storm_built[0]:10.2f} s  {statistics.median(c for c, _ in theirs):6.2f} s"
        said += f"  {checked['sound'][1][0]:6.2f} s  {ratio(ours, theirs, 1):12.2f}  "
        said += f"{ratio(ours, theirs, 0):5.2f}  " + "  ".join(
            agreement(found, storm.costs(game, result), options.precision)
            for result, _ in checked.values()
        )
    print(f"{kind:4} {game.n_states:8} {len(game.successor):9}  {built[0]:5.2f} s  {seconds:6.2f} s"
          f"  {found.width:7.1e}{said}", flush=True)  # fmt: skip


def timed(work: Callable[[], Any]) -> tuple[Any, tuple[float, float]]:
    """What some work gives, with its seconds on the clock and of the CPU."""
    begun = time.perf_counter(), time.process_time()
    found = work()
    return found, (time.perf_counter() - begun[0], time.process_time() - begun[1])


def ratio(ours: list[Any], theirs: list[Any], which: int) -> float:
    """The median over the rounds."""
    pairs = zip(ours, theirs, strict=True)
    return statistics.median(mine[which] / other[which] for mine, other in pairs)


def agreement(found: Any, cost: Any, precision: float) -> str:
    """Whether another solver's costs are within our bounds and its precision."""
    off = (found.lower - precision > -cost) | (-cost > found.upper + precision)
    return f"{int(off.sum())} do not" if off.any() else "yes"


if __name__ == "__main__":
    main()
