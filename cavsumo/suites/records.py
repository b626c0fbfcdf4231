"""The content of a suite's file, validated; places and speeds may be expressions."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from cavsumo.suites.expressions import Value

Number = float | str  # a number or an expression
STANDARD, EXTENDED = "standard", "extended"


class SuiteRecord(BaseModel):
    """A table of a suite's file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class SuiteBody(SuiteRecord):
    """A box with a name.

    Expressions have its sizes as NAME_length, NAME_width and NAME_front: the distance from its
    front to its reference point, half its length if not given.
    """

    kind: str
    length_m: float = Field(gt=0)
    width_m: float = Field(gt=0)
    front_m: float | None = None


class EvenSteps(SuiteRecord):
    """Numbers in even steps, both ends included."""

    first: float = Field(alias="from")
    last: float = Field(alias="to")
    by: float = Field(1.0, gt=0)

    def numbers(self) -> list[Value]:
        """The numbers; whole ones as whole numbers."""
        count = math.floor((self.last - self.first) / self.by + 1e-6) + 1
        found = [round(self.first + i * self.by, 9) for i in range(max(0, count))]
        return [int(number) if number.is_integer() else number for number in found]


class CellRange(SuiteRecord):
    """A block of cases: all combinations of the values of some parameters."""

    range: Literal["standard", "extended"] = "standard"
    values: dict[str, EvenSteps | list[Value] | Value] = Field(default_factory=dict)

    def options(self) -> list[list[Value]]:
        """The values of each parameter."""
        return [
            one.numbers() if isinstance(one, EvenSteps) else one if isinstance(one, list) else [one]
            for one in self.values.values()
        ]

    @model_validator(mode="before")
    @classmethod
    def _keys_are_parameters(cls, given: Any) -> Any:
        """The keys besides range are the parameters."""
        if isinstance(given, dict) and "values" not in given:
            return {
                "range": given.get("range", STANDARD),
                "values": {key: value for key, value in given.items() if key != "range"},
            }
        return given


class SuiteTest(SuiteRecord):
    """A test: where it takes place, its cells, and what everybody does.

    Attributes:
        ego_route: edges, or parameters whose values are edges.
        case: parameters of which a case's name is made, after the test's.
        values: named expressions, each of which may use those before it.
        shown: values that are shown with the parameters in results.
        ego, testers: as in a script (``model/scenario/script``), with expressions for numbers and
            ``body`` for a box of the suite.
        vary_by, vary_times: what ``--vary`` draws: by name the smallest and the largest number
            that is added to a parameter or a value, or by which it is multiplied.
        end: longest duration of a case [s].
    """

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")
    title: str = ""
    net: str
    ego_route: tuple[str, ...]
    case: tuple[str, ...] = ()
    cells: tuple[CellRange, ...] = Field(min_length=1)
    values: dict[str, Number] = Field(default_factory=dict)
    shown: tuple[str, ...] = ()
    vary_by: dict[str, tuple[float, float]] = Field(default_factory=dict)
    vary_times: dict[str, tuple[float, float]] = Field(default_factory=dict)
    ego: dict[str, Any] = Field(default_factory=dict)
    testers: tuple[dict[str, Any], ...] = Field(min_length=1)
    end: Number = 20.0


class Suite(SuiteRecord):
    """A suite.

    Attributes:
        settings: settings of the scenario that all cases have unless the user gives others.
        values: named numbers and expressions for all tests.
        ego: of all tests, see ``SuiteTest``.
    """

    title: str
    source: str = ""
    note: str = ""
    speed: str = Field("ego_kmh", description="the parameter by which --speeds selects")
    settings: dict[str, Any] = Field(default_factory=dict)
    values: dict[str, Number] = Field(default_factory=dict)
    bodies: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")], SuiteBody] = Field(
        default_factory=dict
    )
    ego: dict[str, Any] = Field(default_factory=dict)
    tests: tuple[SuiteTest, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _told_apart(self) -> Suite:
        names = [test.name for test in self.tests]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"tests: {twice!r} is named twice")
        return self
