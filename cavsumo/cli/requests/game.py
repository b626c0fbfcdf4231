"""Options of the command game, checked before heavy imports."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from cavsumo.cli.requests.files import check_picture
from cavsumo.errors import InputError


@dataclass(frozen=True)
class SolveOptions:
    """Options of the command.

    Attributes:
        file: the game.
        reading: A, B or C.
        precision: largest distance of the bounds.
        trim: solve the solvable part.
        as_json: as JSON instead of a table.
        picture: file to draw the game's tree into.
        policy_picture: file to draw the policy into.
        time_limit: seconds after which to give up, None: never.
        quiet: no progress.
    """

    file: Path
    reading: str
    precision: float
    trim: bool
    as_json: bool
    picture: Path | None
    policy_picture: Path | None
    time_limit: float | None
    quiet: bool


def check_solve(order: SolveOptions) -> None:
    """Refuse wrong numbers, names and files."""
    if not (math.isfinite(order.precision) and order.precision > 0):
        raise InputError(f"--precision: expected a positive number, got {order.precision:g}")
    if order.time_limit is not None and not order.time_limit > 0:
        raise InputError(f"--time-limit: expected positive seconds, got {order.time_limit:g}")
    check_picture("--picture", order.picture)
    check_picture("--policy-picture", order.policy_picture)
    try:
        order.file.open("rb").close()
    except OSError as error:
        raise InputError(f"game {str(order.file)!r}: {error.strerror}") from error
