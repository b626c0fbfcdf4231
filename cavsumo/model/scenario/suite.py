"""Which cases of a suite a batch plays."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class SuiteChoice(BaseModel):
    """A suite and a selection of its cases.

    ``only``: tests or cases, such as CPNA or CPNA/30/* ; ``speeds``: of the ego, in the unit of
    the suite; ``extended``: also the cells beyond the standard range; ``vary``: variations of each
    case besides itself; ``values``: numbers in place of values and sizes of the suite.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    only: tuple[str, ...] = ()
    speeds: tuple[float, ...] = ()
    extended: bool = False
    vary: int = Field(0, ge=0, le=10_000)
    values: tuple[tuple[str, float], ...] = ()
