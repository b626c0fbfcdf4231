"""The request for an estimate: how its result is shown."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class EstimateShown:
    """How the result of an estimate is shown.

    Attributes:
        as_json: as one JSON object.
        picture: a file to draw its development into; None for none.
        bound: the upper end that is asked for; None for none.
    """

    as_json: bool
    picture: Path | None
    bound: float | None
