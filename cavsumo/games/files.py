"""Games in files: format ``ssp-games-1``, one game a file, as JSON.

``{"id": ..., "n_states": n, "goal": [state, ...], "initial": state,
"transitions": [[state, tester action, ego action, [[next, probability, reward], ...]], ...]}``

Probabilities and rewards are numbers or strings such as "1/3"; decimals are read exactly.
Keys that are not named here are ignored.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from cavsumo.games.build import from_transitions, rational
from cavsumo.games.model import Game, GameError
from cavsumo.model.documents import json_of, read_text

KEYS = ("n_states", "goal", "initial", "transitions")
SHAPE = "[state, tester action, ego action, [[next, probability, reward], ...]]"


def read_game(file: Path) -> Game:
    """The game in a file.

    Raises:
        InputError: there is none; one sentence with file, key or state, and what was expected.
    """
    text = read_text(file, "game")
    try:
        case = json_of(text, parse_float=rational)
    except ValueError as error:
        raise GameError(f"game {str(file)!r}: {error}") from error
    try:
        return game_of(case)
    except GameError as error:
        raise GameError(f"game {str(file)!r}: {error}") from None


def game_of(case: Any) -> Game:
    """The game of a case object; raises GameError."""
    if not isinstance(case, dict):
        raise GameError(f"expected one object with the keys {', '.join(KEYS)}")
    missing = [key for key in KEYS if key not in case]
    if missing:
        hint = "; a file holds one of the cases" if "cases" in case else ""
        raise GameError(f"expected the key {missing[0]!r}{hint}")
    n_states = _whole("n_states", case["n_states"])
    if n_states < 1:
        raise GameError("n_states: expected at least 1")
    goal, transitions = _list("goal", case["goal"]), _list("transitions", case["transitions"])
    return from_transitions(
        n_states,
        [_whole("goal", state) for state in goal],
        [_transition(i, one) for i, one in enumerate(transitions)],
        initial=_whole("initial", case["initial"]),
        name=str(case.get("id", "")),
    )


def _whole(key: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise GameError(f"{key}: expected a whole number, got {_shown(value)}")
    return value


def _list(key: str, value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise GameError(f"{key}: expected a list, got {_shown(value)}")
    return value


def _shown(value: Any) -> str:
    """A JSON value in an error message."""
    text = json.dumps(value, default=float)
    return text if len(text) <= 60 else text[:57] + "..."


def _transition(i: int, one: Any) -> tuple[int, int, int, list[tuple[int, Any, Any]]]:
    """A transition of the file, shape checked."""
    key = f"transitions[{i}]"
    if not isinstance(one, list) or len(one) != 4 or not isinstance(one[3], list):
        raise GameError(f"{key}: expected {SHAPE}, got {_shown(one)}")
    state, tester, ego = (_whole(key, number) for number in one[:3])
    place = f"{key} (state {state})"
    for outcome in one[3]:
        if not isinstance(outcome, list) or len(outcome) != 3:
            raise GameError(
                f"{place}: expected outcomes [next, probability, reward], got {_shown(outcome)}"
            )
    return state, tester, ego, [(_whole(place, o[0]), o[1], o[2]) for o in one[3]]
