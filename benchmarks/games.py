"""Solving games and MDPs beside Storm, in one run, to the same absolute precision.

    python benchmarks/games.py [--mdp COLUMNS ...] [--game COLUMNS ...] [--precision P] [--no-storm]

MDPs are those of ``rings.one_pedestrian`` (15 states a column), games those of
``rings.two_pedestrians`` (75 states a column). cavsumo's seconds include everything after the
arrays are there: regions, solvability, order, bounds and their check; Storm's are its model
checking without building the model. Storm has no solver for these games that answers through
Python, so it gets the MDPs alone. Both have one thread. Compiled loops are loaded before the clock
starts.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import time
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
    parser.add_argument("--no-storm", action="store_true")
    options = parser.parse_args()
    storm = None
    if not options.no_storm and importlib.util.find_spec("stormpy"):
        import storm as bridge

        storm = bridge
    solve(rings.two_pedestrians(24, 7))
    solve(rings.one_pedestrian(2000))  # loads the compiled loops
    print(f"{'':5}  {'states':>8}  {'outcomes':>9}  {'cavsumo':>8}  {'width':>7}  "
          f"{'Storm OVI':>9}  {'Storm SVI':>9}  {'ratio':>5}  agree")  # fmt: skip
    for columns in options.mdp:
        line("MDP", rings.one_pedestrian(columns), options.precision, storm)
    for columns in options.game:
        line("game", rings.two_pedestrians(columns, 7), options.precision, None)


def line(kind: str, game: Game, precision: float, storm: Any) -> None:
    """Solve by all that can and compare."""
    begun = time.perf_counter()
    found = solve(game, precision=precision)
    seconds = time.perf_counter() - begun
    others, agree = [], ""
    for method in ("optimistic", "sound") if storm else ():
        cells = np.arange(game.n_cells)
        cost, taken = storm.expected_cost(
            game, cells, least=True, precision=precision, method=method
        )
        others.append(taken)
        near = (found.lower - precision <= -cost) & (-cost <= found.upper + precision)
        agree += " yes" if near.all() else f" {int((~near).sum())} do not"
    said = "".join(f"  {taken:7.2f} s" for taken in others)
    ratio = f"  {seconds / others[0]:5.2f} {agree}" if others else ""
    print(f"{kind:5}  {game.n_states:8}  {len(game.successor):9}  {seconds:6.2f} s  "
          f"{found.width:7.1e}{said}{ratio}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
