"""How a scenario is played: by which agents, how often, from which seed, until when."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from cavsumo.model.gone_settings import GONE, without_gone
from cavsumo.model.labels import cast_of
from cavsumo.model.scenario.option import Option
from cavsumo.model.scenario.params import Params, qualified
from cavsumo.model.scenario.record import Scenario
from cavsumo.model.scenario.sensor import Finite
from cavsumo.model.scenario.suite import SuiteChoice

NO_REFERENCE = "none"  # in place of a reference driver's name: violations are not judged


class BatchPlan(BaseModel):
    """A batch of episodes of one scenario."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    scenario: Scenario
    reference: Annotated[str, Option("assertions", choices="reference driver")] = Field(
        "human",
        description="the driver who takes over to see whether a violation was avoidable; human is "
        "careful and competent (UN R157), none leaves it out",
    )
    agents: Annotated[
        tuple[str, ...], Option("tester agents", ("--agent",), "NAME", choices="agent")
    ] = Field(
        ("timing",),
        min_length=1,
        description="a tester agent by name (cavsumo agents) or policy:FILE; several are "
        "compared; LABEL=NAME for one with parameters of its own",
    )
    params: Annotated[
        Params, Option("tester agents", ("--param",), "KEY=VALUE", environments=True)
    ] = Field(
        default_factory=dict,
        description="a parameter of the agents that have it; NAME.KEY or LABEL.KEY for one",
    )
    known: dict[str, tuple[Any, ...]] | None = Field(
        None,
        description="what agents know at the beginning of every episode, by label: then nobody "
        "learns from one episode for the next",
    )
    suite: SuiteChoice | None = Field(
        None, description="the suite whose cases are played, one a run, in place of one scenario"
    )
    runs: Annotated[int, Option("batch", metavar="N")] = Field(
        100, ge=1, le=10_000_000, description="episodes an agent"
    )
    seed: Annotated[int, Option("batch", metavar="SEED", environments=True)] = Field(
        1, ge=0, le=2**63 - 1, description="seed of the batch"
    )
    deadline_s: Annotated[Finite, Option("batch", ("--deadline",), "S")] = Field(
        120.0, gt=0, description="real time that an episode may take [s]"
    )
    shard: Annotated[str | None, Option("processes", metavar="I/N", unset="all of it")] = Field(
        None,
        description="play part I of N of the episodes; cavsumo merge puts the parts together",
    )
    first: Annotated[bool, Option("stopping early", ("-x", "--first"))] = Field(
        False,
        description="stop at the first failure (with a reference driver: the first preventable "
        "one)",
    )
    until_tests: Annotated[int | None, Option("stopping early", metavar="N")] = Field(
        None, ge=1, description="stop after N tests"
    )
    until_half_width: Annotated[str | None, Option("stopping early", metavar="H")] = Field(
        None,
        description="stop when every agent's rate is known to H, such as 0.02, or 10% of the rate",
    )
    until_rate: Annotated[Literal["tests", "preventable", "failures"], Option("stopping early")] = (
        Field(
            "tests",
            description="the rate meant: tests among episodes, preventable failures or all "
            "failures among tests",
        )
    )
    budget_s: Annotated[Finite | None, Option("stopping early", ("--budget",), "S", "no limit")] = (
        Field(None, gt=0, description="stop after so much real time [s]")
    )
    trace: Annotated[Literal["none", "tests", "all"], Option("output")] = Field(
        "tests", description="episodes whose frames are kept"
    )

    @model_validator(mode="before")
    @classmethod
    def _without_gone(cls, value: Any) -> Any:
        """A plan that 0.1 recorded, without the settings that are gone; they had one value."""
        if not isinstance(value, Mapping):
            return value
        kept = without_gone(value)
        for key in GONE.keys() & kept.keys():
            raise ValueError(f"{key} {kept[key]}: {GONE[key].words}")
        return kept

    @field_validator("params", mode="before")
    @classmethod
    def _of_one(cls, value: Any) -> Any:
        """``NAME.KEY`` for one of several agents, in TOML also as a table of its own."""
        return qualified(value)

    @field_validator("until_half_width", mode="before")
    @classmethod
    def _as_text(cls, value: Any) -> Any:
        """A number in a scenario file means the same as on the command line."""
        return f"{value}" if isinstance(value, int | float) else value

    @field_validator("until_half_width", "shard")
    @classmethod
    def _well_formed(cls, value: str | None, info: ValidationInfo) -> str | None:
        if value is not None:
            part_of(value) if info.field_name == "shard" else half_width(value)
        return value

    @field_validator("until_rate")
    @classmethod
    def _judged(cls, value: str, info: ValidationInfo) -> str:
        if value == "preventable" and info.data.get("reference") == "none":
            raise ValueError("preventable needs a reference driver, and reference is none")
        return value

    @field_validator("agents")
    @classmethod
    def _told_apart(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        cast_of(value)
        return value

    @property
    def cast(self) -> dict[str, str]:
        """The names of the agents by their labels, in the order in which they take turns."""
        return cast_of(self.agents)

    def todo(self) -> Iterator[int]:
        """The numbers of the episodes, those of the shard only if there is one.

        Shards take turns, with one episode of all agents, so that an episode is the same in every
        shard.
        """
        part, parts = part_of(self.shard) if self.shard else (1, 1)
        turn = len(self.agents)
        total = self.runs * turn
        for start in range((part - 1) * turn, total, parts * turn):
            yield from range(start, min(start + turn, total))

    @property
    def size(self) -> int:
        """How many episodes that are."""
        return self.runs * len(self.agents) if self.shard is None else sum(1 for _ in self.todo())

    def agent_params(self, label: str, known: Sequence[str]) -> Params:
        """The parameters meant for one agent: its own (``label.key``) and those it knows."""
        prefix = f"{label}."
        mine = {k: v for k, v in self.params.items() if "." not in k and k in known}
        return mine | {
            k.removeprefix(prefix): v for k, v in self.params.items() if k.startswith(prefix)
        }


def half_width(text: str) -> tuple[float, bool]:
    """A half-width as a number and whether it is relative: ``0.02``, or ``10%`` of the rate."""
    relative = text.endswith("%")
    try:
        value = float(text.removesuffix("%")) / (100.0 if relative else 1.0)
    except ValueError:
        value = math.nan
    if not 0.0 < value < 1.0:
        raise ValueError("must be a share such as 0.02, or one of the rate such as 10%")
    return value, relative


def part_of(text: str) -> tuple[int, int]:
    """A shard ``I/N`` as two numbers, 1 <= I <= N."""
    part, _, parts = text.partition("/")
    if not (part.isdecimal() and parts.isdecimal() and 1 <= int(part) <= int(parts)):
        raise ValueError("must be I/N with 1 <= I <= N, such as 2/8")
    return int(part), int(parts)
