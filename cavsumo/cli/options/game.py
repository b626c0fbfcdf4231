"""Options of the command game; the heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of


def add_game(commands: Any) -> None:
    """The command game with its verbs."""
    game = commands.add_parser(
        "game",
        help="solve a stochastic shortest path game from a file",
        description="Stochastic shortest path games between a tester and an ego (docs/games.md).",
        allow_abbrev=False,
    )
    verbs = game.add_subparsers(title="verbs", required=True, metavar="VERB")
    solve = verbs.add_parser(
        "solve",
        help="certified bounds on the value, an optimal policy, properness and solvability",
        description="Solve a game: for each state bounds on its value, an optimal action of the "
        "tester, and whether a goal can be forced. Exit status 1 when the game is not solvable.",
        allow_abbrev=False,
    )
    add = solve.add_argument
    add("file", type=Path, metavar="FILE", help="a game as JSON, format ssp-games-1")
    add(
        "--reading",
        choices=("A", "B", "C"),
        default="A",
        help="A: the tester commits first; B: both choose at once, mixed; C: the ego commits "
        "first (default A)",
    )
    add(
        "--precision",
        type=float,
        default=1e-6,
        metavar="P",
        help="how far the bounds may be apart (default 1e-6)",
    )
    add("--trim", action="store_true", help="solve what can be solved of an unsolvable game")
    add("--json", dest="as_json", action="store_true", help="print JSON (docs/games.md)")
    add("--picture", type=Path, metavar="FILE", help="draw the game's tree (.png, .svg, .pdf)")
    add("--policy-picture", type=Path, metavar="FILE", help="draw what the policy makes of it")
    add(
        "--time-limit",
        type=float,
        metavar="S",
        help="give up after so many seconds, with exit status 3 (default: never; the number of "
        "steps is bounded in any case)",
    )
    add("-q", "--quiet", action="store_true", help="no progress")
    solve.set_defaults(command=_solve)


def _solve(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.game import SolveOptions, check_solve

    order = SolveOptions(**values_of(options, SolveOptions))
    check_solve(order)
    from cavsumo.cli.commands.game import solve_file

    return solve_file(order)
