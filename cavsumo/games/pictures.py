"""Pictures of a small game: its tree (the seed's Figure 2) and a policy (Figure 3).

Needs matplotlib; draws into a file, never on a screen. Circles are states, where the tester
chooses, squares are the ego's choices, diamonds are chance; double circles are goals.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from cavsumo.errors import InputError
from cavsumo.games.drawing import LIMIT, Node, size, tree
from cavsumo.games.model import Game
from cavsumo.games.readings import Reading
from cavsumo.games.solvable import Solvability
from cavsumo.games.solve import Solution

TESTER, EGO, CHANCE, GOAL = "#1b6ca8", "#c0392b", "#f2f2f2", "#2e8b57"
QUIET, INK = "#b5b5b5", "#222222"
MARKERS = {"state": "o", "goal": "o", "again": "o", "ego": "s", "tester": "s", "chance": "D"}
FILLS = {
    "state": TESTER,
    "goal": GOAL,
    "again": "white",
    "ego": EGO,
    "tester": TESTER,
    "chance": CHANCE,
}
ROUND, SQUARE, SMALL = 420.0, 130.0, 70.0  # points squared
SIZES = {"state": ROUND, "goal": ROUND, "again": ROUND, "ego": SQUARE, "tester": SQUARE}
SIZES |= {"chance": SMALL}
STATES_DRAWN = 40  # in the picture of a policy


def draw_tree(game: Game, verdict: Solvability, solution: Solution | None, file: Path) -> None:
    """Draw the game's tree, the policies' choices in colour; raises InputError if it is too big.

    Each state is unfolded once; where it is met again a dashed circle stands for it.
    """
    root = tree(game, verdict.reading, lambda cell: _taken(solution, cell))
    leaves, depth = size(root)
    if leaves > LIMIT:
        raise InputError(
            f"--picture: the tree of game {game.name!r} has {leaves} leaves, "
            f"expected at most {LIMIT}"
        )
    figure = Figure(figsize=(max(7.0, 0.74 * leaves), 1.15 * depth + 1.6), dpi=150)
    axes = figure.add_subplot()
    _branches(axes, root, verdict.reading is not Reading.C)
    axes.set(xlim=(-0.8, leaves - 0.2), ylim=(-depth - 0.5, 0.6))
    _finish(figure, axes, _title(game, verdict, solution), _tree_legend(verdict.reading), file)


def _taken(solution: Solution | None, cell: int) -> tuple[bool, bool]:
    """Whether tester and ego play a cell with positive probability."""
    if solution is None:
        return False, False
    found = solution.certificate
    return bool(found.tester[cell] > 0), bool(found.ego[cell] > 0)


def _branches(axes: Axes, node: Node, tester_first: bool, lit: bool = True) -> None:
    """Draw a node, its edges and all nodes below; in colour where the play may come."""
    for i, child in enumerate(node.children):
        on = lit and child.chosen
        colour = _edge_colour(node.kind, tester_first) if on else QUIET
        xs, ys = (node.x, child.x), (-node.depth, -child.depth)
        axes.plot(xs, ys, color=colour, lw=2.2 if on else 0.9, zorder=2 if on else 1)
        wide = node.kind == "chance" and len(node.children) > 1  # no room side by side
        share = 0.42 + 0.24 * (i % 2) if wide else 0.55
        axes.text(
            xs[0] + share * (xs[1] - xs[0]),
            ys[0] + share * (ys[1] - ys[0]),
            child.edge,
            fontsize=7,
            color=INK if on else "#777777",
            ha="center",
            va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            zorder=3,
        )
        _branches(axes, child, tester_first, on)
    _mark(axes, node, lit)


def _edge_colour(kind: str, tester_first: bool) -> str:
    """The colour of the player that chooses among the edges below a node."""
    if kind == "state":
        return TESTER if tester_first else EGO
    return {"ego": EGO, "tester": TESTER}.get(kind, INK)


def _mark(axes: Axes, node: Node, lit: bool) -> None:
    """The symbol of a node, white below it so that no edge shines through."""
    faint = 1.0 if lit else 0.35
    again = node.kind == "again"
    where = (node.x, -node.depth)
    spot: dict[str, Any] = {"s": SIZES[node.kind], "marker": MARKERS[node.kind]}
    axes.scatter(*where, **spot, facecolor="white", edgecolor="none", zorder=3.5)
    axes.scatter(
        *where,
        **spot,
        facecolor=FILLS[node.kind],
        edgecolor=TESTER if again else INK,
        linestyle="--" if again else "-",
        linewidth=0.9,
        alpha=faint,
        zorder=4,
    )
    if node.kind == "goal":
        axes.scatter(*where, s=270, facecolor="none", edgecolor="white", lw=1.0, zorder=5)
    if node.text:
        colour = TESTER if again else "white"
        axes.text(*where, node.text, ha="center", va="center", fontsize=8, color=colour, zorder=6)


def _title(game: Game, verdict: Solvability, solution: Solution | None) -> str:
    """The title of the picture."""
    name = game.name or "game"
    if solution is None:
        return f"{name}: not solvable in reading {verdict.reading}"
    low, high = solution.lower[game.initial], solution.upper[game.initial]
    value = f"{(low + high) / 2:.5g}" if math.isfinite(low) else "\u2212\u221e"
    return f"{name}, reading {verdict.reading}: V({game.label(game.initial)}) = {value}".replace(
        "-", "\u2212"
    )


def _tree_legend(reading: Reading) -> list[Line2D]:
    """The symbols explained."""
    order = "B: both at once" if reading is Reading.B else ""
    second = (
        ("s", EGO, "ego chooses") if reading is not Reading.C else ("s", TESTER, "tester replies")
    )
    first = "tester chooses" if reading is not Reading.C else "state (ego chooses)"
    rows = [("o", TESTER, first), second, ("D", CHANCE, "chance (probability; reward)")]
    rows += [("o", GOAL, "goal"), ("o", "white", "state unfolded elsewhere")]
    marks = [
        Line2D([], [], ls="", marker=m, mfc=fill, mec=INK, ms=8, label=text)
        for m, fill, text in rows
    ]
    marks.append(Line2D([], [], color=TESTER, lw=2.2, label="played by the policies"))
    if order:
        marks.append(Line2D([], [], ls="", label=order))
    return marks


def _finish(figure: Figure, axes: Axes, title: str, legend: list[Line2D], file: Path) -> None:
    """Title, legend, no axes; write the file."""
    axes.set_axis_off()
    axes.set_title(title, loc="left", fontsize=11)
    axes.legend(
        handles=legend,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.02),
        ncols=3,
        frameon=False,
        fontsize=8,
    )
    key = {".svg": "Date", ".pdf": "CreationDate"}.get(file.suffix.lower())
    metadata = {key: None} if key else {}  # the same picture is the same bytes
    try:
        figure.savefig(file, bbox_inches="tight", pad_inches=0.15, metadata=metadata)
    except OSError as error:
        raise InputError(f"{str(file)!r}: {error.strerror}") from error


def draw_policy(game: Game, verdict: Solvability, solution: Solution | None, file: Path) -> None:
    """Draw the play of the policies: the states that it reaches, from left to right.

    States with larger values stand higher; an arrow is a step that may be made, with its
    probability.
    """
    if solution is None:
        raise InputError(f"--policy-picture: game {game.name!r} is not solvable")
    steps = _steps(game, solution)
    if len(steps) > STATES_DRAWN:
        raise InputError(
            f"--policy-picture: the policy of game {game.name!r} meets {len(steps)} states, "
            f"expected at most {STATES_DRAWN}"
        )
    places = _places(game, steps, solution)
    figure, axes = _canvas(list(places.values()))
    for state, (moves, after) in steps.items():
        _state(axes, game, solution, state, places[state], moves)
        for successor, probability in after.items():
            _arrow(axes, places[state], places[successor], probability)
    marks = [("o", TESTER, "state: value, tester's action"), ("o", GOAL, "goal")]
    legend = [Line2D([], [], ls="", marker=m, mfc=c, mec=INK, ms=8, label=t) for m, c, t in marks]
    legend.append(Line2D([], [], color=INK, marker=">", ms=4, label="step, with its probability"))
    _finish(figure, axes, _title(game, verdict, solution), legend, file)


def _canvas(places: list[tuple[float, float]]) -> tuple[Figure, Axes]:
    """A figure in which one unit is as long in both directions, with room for bows and words."""
    xs, ys = [x for x, _ in places], [y for _, y in places]
    left, right, low, high = min(xs) - 0.9, max(xs) + 0.9, min(ys) - 1.0, max(ys) + 0.9
    figure = Figure(figsize=(max(4.5, 1.15 * (right - left)), 1.15 * (high - low)), dpi=150)
    axes = figure.add_subplot()
    axes.set(xlim=(left, right), ylim=(low, high), aspect="equal")
    return figure, axes


def _steps(game: Game, solution: Solution) -> dict[int, tuple[str, dict[int, float]]]:
    """The states met from the initial one: the tester's actions, the next states."""
    found: dict[int, tuple[str, dict[int, float]]] = {}
    waiting = [game.initial]
    proof, reading = solution.certificate, solution.verdict.reading
    while waiting:
        state = waiting.pop(0)
        if state in found:
            continue
        after: dict[int, float] = {}
        moves: dict[int, float] = {}
        for row in game.rows(state):
            for cell in game.cells(row):
                weight = float(proof.tester[cell] * proof.ego[cell])
                if weight > 0:
                    action = int(game.tester_action[row])
                    moves[action] = moves.get(action, 0.0) + weight
                    for successor, p, _ in game.outcomes(cell):
                        after[successor] = after.get(successor, 0.0) + weight * p
        mixed = reading is Reading.B and len(moves) > 1
        words = "\n".join(f"{a} ({p:.2g})" if mixed else str(a) for a, p in moves.items())
        found[state] = (words, after)
        waiting += after
    return found


def _places(
    game: Game, steps: dict[int, tuple[str, dict[int, float]]], solution: Solution
) -> dict[int, tuple[float, float]]:
    """From left to right by the number of steps, one above the other by value."""
    column = {game.initial: 0}
    waiting = [game.initial]
    while waiting:
        state = waiting.pop(0)
        for successor in steps[state][1]:
            if successor not in column:
                column[successor] = column[state] + 1
                waiting.append(successor)
    last = max((c for s, c in column.items() if not game.goal[s]), default=0) + 1
    column = {s: last if game.goal[s] else c for s, c in column.items()}
    places = {}
    for c in set(column.values()):
        here = sorted((s for s in column if column[s] == c), key=lambda s: solution.lower[s])
        for i, state in enumerate(here):
            places[state] = (2.0 * c, 1.5 * (i - (len(here) - 1) / 2) + 0.3 * (c % 2))
    return places


def _state(
    axes: Axes, game: Game, solution: Solution, state: int, place: tuple[float, float], moves: str
) -> None:
    """Draw a state with its value and the tester's action there."""
    goal = bool(game.goal[state])
    axes.scatter(*place, s=620, facecolor=GOAL if goal else TESTER, edgecolor=INK, zorder=4)
    axes.text(*place, game.label(state), color="white", ha="center", va="center", zorder=5)
    if not goal:
        value = float(np.mean([solution.lower[state], solution.upper[state]]))
        text = f"{value:.4g}".replace("-", "\u2212") + f"\nplays {moves}"
        axes.annotate(
            text, place, (0, -17), textcoords="offset points", ha="center", va="top", fontsize=8
        )


def _arrow(axes: Axes, a: tuple[float, float], b: tuple[float, float], probability: float) -> None:
    """A step from a to b; back and round on a bow."""
    style: dict[str, Any] = {"arrowstyle": "-|>", "color": INK, "lw": 0.6 + 1.4 * probability}
    label = "" if probability > 1.0 - 1e-9 else f"{probability:.3g}"
    if a == b:
        top = (a[0], a[1] + 0.58)
        style |= {"connectionstyle": "arc3,rad=-2.2", "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (a[0] + 0.11, a[1] + 0.16), (a[0] - 0.11, a[1] + 0.16), arrowprops=style)
        axes.text(*top, label, ha="center", fontsize=8)
        return
    bow = 0.14 if b[0] - a[0] == 2.0 else 0.28
    style |= {"connectionstyle": f"arc3,rad={bow}", "shrinkA": 14, "shrinkB": 15}
    axes.annotate("", b, a, arrowprops=style, zorder=2)
    dx, dy = b[0] - a[0], b[1] - a[1]
    at = (a[0] + 0.5 * dx + bow * dy / 2, a[1] + 0.5 * dy - bow * dx / 2)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
    axes.text(*at, label, ha="center", va="center", fontsize=8, bbox=box, zorder=3)
