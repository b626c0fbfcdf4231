"""The exposure: what people do by chance at a place, as a TOML file states it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.documents import LARGEST_TOML_B, first_problem, read_text, toml_of
from cavsumo.probability.distributions import KINDS, Distribution, Number

DEFAULT = Path(__file__).with_name("default.toml")
Share = Annotated[Number, Field(ge=0.0, le=1.0)]
Positive = Annotated[Number, Field(gt=0.0)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Arrivals(_Table):
    """Arrivals at the kerb: an hour, and within how many seconds before the ego is there."""

    per_hour: Positive
    within_s: Annotated[Positive, Field(le=60.0)]


class Attention(_Table):
    """The share of those who step off without a look."""

    inattentive: Share


class Compliance(_Table):
    """The share of those who do not wait for a red light."""

    against_red: Share


class Hesitation(_Table):
    """The share of those who stop on the road, and for how long."""

    share: Share
    pause_s: Distribution


class VehicleExposure(_Table):
    """The exposure of cyclists or of drivers."""

    arrivals: Arrivals
    speed_mps: Distribution
    critical_gap_s: Distribution
    attention: Attention
    compliance: Compliance


class Exposure(_Table):
    """An exposure, of pedestrians but for the last two tables.

    See ``default.toml`` for the meaning and the source of every number.
    """

    arrivals: Arrivals
    speed_mps: Distribution
    critical_gap_s: Distribution
    attention: Attention
    compliance: Compliance
    hesitation: Hesitation
    bicycle: VehicleExposure
    car: VehicleExposure


def read_exposure(file: Path | None = None) -> Exposure:
    """The exposure of a file, with the default for what it leaves out; None: the default.

    Raises:
        InputError: in one sentence that names the file and the key.
    """
    if file is None:
        return Exposure.model_validate(_defaults())
    try:
        given = toml_of(read_text(file, "exposure", largest=LARGEST_TOML_B))
        return Exposure.model_validate(_over(_defaults(), given))
    except ValidationError as error:
        raise _problem(file, error) from error
    except ValueError as error:
        raise InputError(f"{_named(file)}: {error}") from error


def exposure_of(params: Mapping[str, Any]) -> tuple[Exposure, str]:
    """The exposure that the parameters of an agent name, and its name in the sentence of an error.

    Raises as ``read_exposure``.
    """
    file = str(params.get("exposure") or "")
    return (read_exposure(Path(file)), _named(file)) if file else (read_exposure(), "exposure")


def _named(file: str | Path) -> str:
    return f"exposure {str(file)!r}"


@cache
def _defaults() -> dict[str, Any]:
    return toml_of(DEFAULT.read_text(encoding="utf-8"))


def _over(defaults: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Given tables over the default ones; a distribution is replaced as a whole."""
    found = dict(defaults)
    for key, value in given.items():
        before = found.get(key)
        if isinstance(before, dict) and isinstance(value, dict) and "distribution" not in before:
            found[key] = _over(before, value)
        else:
            found[key] = value
    return found


def _problem(file: Path, error: ValidationError) -> InputError:
    """The first problem of a file; an unknown key with the nearest one that there is."""
    problem = error.errors(include_url=False)[0]
    where = _named(file)
    if problem["type"] != "extra_forbidden":
        return InputError(f"{where}: {first_problem(error)}")
    *table, key = (str(part) for part in problem["loc"])
    model: Any = Exposure
    for name in table:
        found = getattr(model, "model_fields", {}).get(name)
        model = KINDS.get(name, found.annotation if found else None)
    valid = getattr(model, "model_fields", {})
    return UnknownName("key", key, valid, ": ".join([where, *table[:1]]))
