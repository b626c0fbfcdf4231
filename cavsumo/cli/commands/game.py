"""``cavsumo game solve``: bounds, policy, properness and solvability, as a table or as JSON."""

from __future__ import annotations

import io
import json
import math
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from cavsumo.cli.requests.game import SolveOptions
from cavsumo.cli.steps import say_written
from cavsumo.errors import Exit
from cavsumo.games.approach import Tell
from cavsumo.games.files import read_game
from cavsumo.games.model import Game
from cavsumo.games.policies import ego_actions
from cavsumo.games.readings import Reading
from cavsumo.games.solvable import Solvability
from cavsumo.games.solve import NotCertified, Solution, Unsolvable, solve

FORMAT = 1  # of the JSON; raised when a key changes its meaning or goes
SHOWN = 60  # states in the table
EVERY_S = 10.0  # between lines of progress where there is no terminal


def solve_file(order: SolveOptions) -> int:
    """Solve the game in a file and print the solution."""
    painters = _painters(order)
    try:
        with _progress(order.quiet) as tell, _stdout_kept():
            tell("reading the file", math.inf)
            game = read_game(order.file)
            found = solve(
                game,
                order.reading,
                order.precision,
                trim=order.trim,
                time_limit=order.time_limit,
                tell=tell,
            )
        verdict, solution = found.verdict, found
    except Unsolvable as error:
        verdict, solution = error.verdict, None
    except NotCertified as error:
        print(f"cavsumo: game {str(order.file)!r}: {error}", file=sys.stderr)
        return Exit.NOT_RUN
    for painter, file in painters:
        painter(game, verdict, solution, file)
    say_written([file for _, file in painters], quiet=order.quiet)
    show = _json if order.as_json else _table
    print(show(order, game, verdict, solution))
    return _status(order, verdict, solution)


@contextmanager
def _stdout_kept() -> Iterator[None]:
    """Send the output of compiled libraries to stderr: stdout has only the result."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def _status(order: SolveOptions, verdict: Solvability, solution: Solution | None) -> int:
    """The exit status, with a note on stderr when the bounds are wider than the precision."""
    if solution is not None and not solution.precise:
        print(
            f"cavsumo: the bounds are {solution.width:.3g} apart, not {order.precision:g}: floats "
            "are too coarse for values of this size",
            file=sys.stderr,
        )
        return Exit.NOT_RUN
    return Exit.OK if verdict.solvable else Exit.VIOLATED


def _painters(order: SolveOptions) -> list[tuple[Any, Path]]:
    """The functions that draw, with their files."""
    wanted = [(order.picture, "draw_tree"), (order.policy_picture, "draw_policy")]
    found = []
    for file, name in wanted:
        if file is None:
            continue
        from cavsumo.games import pictures

        found.append((getattr(pictures, name), file))
    return found


@contextmanager
def _progress(quiet: bool) -> Iterator[Tell]:
    """The current step, on stderr: live on a terminal, a line at intervals elsewhere."""
    if quiet:
        yield lambda _, __: None
    elif sys.stderr.isatty():
        columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
            task = shown.add_task("solving", total=None)
            yield lambda doing, left: shown.update(task, description=_said(doing, left))
    else:
        with _lines() as tell:
            yield tell


@contextmanager
def _lines() -> Iterator[Tell]:
    """A line every EVERY_S with the seconds so far, also during a longer step."""
    begun, over, said = time.monotonic(), threading.Event(), "solving"

    def tell(doing: str, left: float) -> None:
        nonlocal said
        said = _said(doing, left)

    def speak() -> None:
        while not over.wait(EVERY_S):
            print(f"{said}, {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)

    speaker = threading.Thread(target=speak, daemon=True)
    speaker.start()
    try:
        yield tell
    finally:
        over.set()
        speaker.join()


def _said(doing: str, left: float) -> str:
    """The current step, in words."""
    return f"solving: {doing}" + (f", residual {left:.1e}" if math.isfinite(left) else "")


# JSON


def _json(order: SolveOptions, game: Game, verdict: Solvability, solution: Solution | None) -> str:
    """The result as JSON, with stable keys (docs/games.md)."""
    found: dict[str, Any] = {
        "format": FORMAT,
        "id": game.name,
        "reading": verdict.reading.value,
        "precision": order.precision,
        "solvable": verdict.solvable,
        "reason": verdict.reason(game) or None,
        "witness": _witness(verdict),
        "initial": game.initial,
        "proper_region": verdict.proper.inside.tolist(),
        "sure_region": [int(t) if t >= 0 else None for t in verdict.sure.layer],
        "lower": None,
        "upper": None,
        "policy": None,
    }
    if solution is not None:
        found["lower"] = [_number(x) for x in solution.lower]
        found["upper"] = [_number(x) for x in solution.upper]
        found["policy"] = [_move(game, solution, state) for state in range(game.n_states)]
    return json.dumps(found)


def _witness(verdict: Solvability) -> dict[str, Any] | None:
    """The states that make the game unsolvable."""
    if verdict.solvable:
        return None
    trap, cycle = verdict.trap, verdict.cycle
    return {
        "trap": None if trap is None else trap.states.tolist(),
        "lost": None if trap is None else trap.lost.tolist(),
        "cycle": None if cycle is None else cycle.states.tolist(),
        "cycle_gain": None if cycle is None else cycle.gain,
    }


def _number(x: float) -> float | str:
    """A bound; JSON has no infinity."""
    return float(x) if math.isfinite(x) else "-inf"


def _move(game: Game, solution: Solution, state: int) -> Any:
    """The tester's move in a state: an action, in B weights, in C a reply to each action.

    None at goals and in states from which no goal can be forced.
    """
    if game.goal[state] or not np.isfinite(solution.lower[state]):
        return None
    weights = solution.certificate.tester
    rows = game.rows(state)
    if solution.verdict.reading is Reading.C:
        answers = {}
        for row in rows:
            for cell in game.cells(row):
                if weights[cell] > 0:
                    answers[str(game.ego_action[cell])] = int(game.tester_action[row])
        return {str(a): answers[str(a)] for a in ego_actions(game, state)}
    mixed = {int(game.tester_action[r]): float(weights[game.cell_start[r]]) for r in rows}
    if solution.verdict.reading is Reading.A:
        return max(mixed, key=lambda action: mixed[action])
    return {str(action): weight for action, weight in mixed.items() if weight > 0}


# Table


def _table(order: SolveOptions, game: Game, verdict: Solvability, solution: Solution | None) -> str:
    """The result as a text."""
    text = io.StringIO()
    console = Console(width=110, file=text)
    goals = int(game.goal.sum())
    _say(
        console,
        f"game {game.name or order.file.name}: {game.n_states} states, {goals} of them goals; "
        f"reading {verdict.reading}, {verdict.reading.order}",
    )
    _say(console, _solvable_in_words(game, verdict))
    if solution is None:
        return text.getvalue().rstrip("\n")
    console.print(_states_table(game, verdict, solution))
    if game.n_states > SHOWN:
        _say(console, f"... and {game.n_states - SHOWN} more states; --json prints all")
    low, high = solution.lower[game.initial], solution.upper[game.initial]
    _say(
        console,
        f"initial state {game.initial}: {_down(low)} <= V <= {_up(high)}; bounds at most "
        f"{solution.width:.2g} apart, proven",
    )
    return text.getvalue().rstrip("\n")


def _say(console: Console, text: str) -> None:
    """Print plain text, never wrapped, marked up or coloured."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def _solvable_in_words(game: Game, verdict: Solvability) -> str:
    """Solvability in one line."""
    if not verdict.solvable:
        return f"not solvable: {verdict.reason(game)}"
    longest = int(verdict.sure.layer.max())
    if verdict.sure.inside.all():
        return f"solvable: a goal can be forced within {longest} steps from every state"
    sure = int(verdict.sure.inside.sum())
    return (
        "solvable: a goal can be forced almost surely from every state, within a known number "
        f"of steps from {sure} of {game.n_states}"
    )


def _states_table(game: Game, verdict: Solvability, solution: Solution) -> Table:
    """A line for each state."""
    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0))
    for name in ("state", "lower", "upper", "a goal is", "within", "policy"):
        right = name in ("lower", "upper", "within", "state")
        table.add_column(name, justify="right" if right else "left", no_wrap=name != "policy")
    for state in range(min(game.n_states, SHOWN)):
        steps = int(verdict.sure.layer[state])
        forced = "sure" if steps >= 0 else "almost sure" if verdict.proper.inside[state] else "-"
        cells = [
            game.label(state),
            _down(solution.lower[state]),
            _up(solution.upper[state]),
            "here" if game.goal[state] else forced,
            "" if steps <= 0 else str(steps),
            _in_words(_move(game, solution, state)),
        ]
        table.add_row(*map(Text, cells))
    return table


def _in_words(move: Any) -> str:
    """A move of the policy."""
    if move is None:
        return ""
    if isinstance(move, int):
        return str(move)
    parts = (f"{k}: {v:.4g}" if isinstance(v, float) else f"{k} -> {v}" for k, v in move.items())
    return ", ".join(parts)


def _down(x: float) -> str:
    """Rounded down, so that the printed bound holds."""
    return f"{math.floor(x * 1e7) / 1e7:.7f}" if math.isfinite(x) else "-inf"


def _up(x: float) -> str:
    """Rounded up."""
    return f"{math.ceil(x * 1e7) / 1e7:.7f}" if math.isfinite(x) else "-inf"
