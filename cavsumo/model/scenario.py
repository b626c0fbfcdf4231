"""Everything that defines a test, validated, from TOML or the command line.

``Scenario`` says what is simulated, ``BatchPlan`` how often and with which agents. Unknown keys
are refused with the nearest valid one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)

from cavsumo.errors import InputError, UnknownName, shown
from cavsumo.model.checks import densities
from cavsumo.model.documents import first_problem
from cavsumo.model.labels import cast_of
from cavsumo.model.named_networks import (
    check_network,
    is_named,
    network_file,
    routes_file,
    routes_of,
)
from cavsumo.model.sensors import Sensor

SHARED_BY = 25  # episodes that share one simulation when asked to
Finite = Annotated[float, Field(allow_inf_nan=False)]
# Whose simulation an episode is played in: its own, or one that later episodes use as the same.
Simulation = Literal["own", "new", "same"]
ApproachType = Literal["crossing", "merging", "following", "adjacent"]
Params = dict[str, bool | int | float | str]


class Scenario(BaseModel):
    """One test scenario; every field has its unit in its description."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    net: Path = Field(description="SUMO network: a file, or one of cavsumo's by name")
    routes: Path | None = Field(None, description="background demand; none for empty roads")
    traffic: tuple[float, float] | None = Field(
        None,
        description="background cars and pedestrians drawn for the network: departures per minute "
        "and kilometre of road, each direction counted, and of pavement; instead of routes",
    )
    traffic_seed: int | None = Field(
        None, ge=0, le=2**63 - 1, description="seed that it is drawn from, if not the batch's"
    )
    additional: tuple[Path, ...] = Field((), description="SUMO additional files")
    ego: str = Field(
        "sumo", description="registered ego, module:Class, exec:COMMAND or tcp:HOST:PORT"
    )
    ego_params: Params = Field(default_factory=dict, description="parameters of the ego")
    ego_route: tuple[str, ...] = Field(
        (), description="edges of the ego's route, or one word: straight, left, right or u-turn"
    )
    junction: str | None = Field(None, description="junction under test")
    signal: Literal["any", "green", "red"] = Field(
        "any", description="what the ego meets at the first traffic light on its route"
    )
    testers: int = Field(3, ge=1, le=100, description="number of tester bodies")
    kind: str = Field("pedestrian", description="kind of the tester bodies")
    approaches: tuple[ApproachType, ...] = Field(
        (), description="types of approach on which tester vehicles start; all if not given"
    )
    jaywalk: bool = Field(
        False, description="testers start anywhere beside the road, not on pavements only"
    )
    bodies_per_agent: int = Field(1, ge=1, description="bodies that one agent owns")
    starts_seed: int | None = Field(
        None,
        ge=0,
        le=2**32 - 1,
        description="seed of an episode whose testers' starts all episodes have; each draws its "
        "own if not given",
    )
    start_speed: Finite | None = Field(
        None,
        ge=0,
        description="speed of the testers at the start [m/s]; their maximum if not given",
    )
    embodiment: Literal["vehicle", "person"] = Field(
        "vehicle", description="how SUMO is shown a tester pedestrian"
    )
    sumo_width: Finite = Field(
        0.05, ge=0.01, le=5, description="width that SUMO is shown of a tester pedestrian [m]"
    )
    ego_sensor: Sensor | None = Field(
        None, description="how the ego sees the others; exactly and at once if not given"
    )
    tester_sensor: Sensor | None = Field(None, description="how the tester agents do")
    end: Finite = Field(60.0, gt=0, le=36000, description="horizon of an episode [s]")
    step_length: Finite = Field(0.1, ge=0.001, le=1, description="timestep lambda [s]")
    assertions: tuple[str, ...] = Field(
        ("reaction-zone",),
        min_length=1,
        description="what the ego must keep: registered assertions, module:function, formulas; all "
        "formulas if only those are given",
    )
    assertion_params: Params = Field(default_factory=dict, description="their parameters")
    formulas: dict[str, str] = Field(
        default_factory=dict, description="temporal-logic formulas by name (docs/formulas.md)"
    )

    @model_validator(mode="before")
    @classmethod
    def _formulas_are_asserted(cls, given: Any) -> Any:
        """Formulas without a list of assertions are what is asserted."""
        formulas = given.get("formulas") if isinstance(given, Mapping) else None
        if formulas and isinstance(formulas, Mapping) and "assertions" not in given:
            return {**given, "assertions": tuple(formulas)}
        return given

    @field_validator("step_length")
    @classmethod
    def _whole_milliseconds(cls, value: float) -> float:
        """SUMO's clock counts milliseconds; anything else would drift silently."""
        if not math.isclose(value * 1000, round(value * 1000), abs_tol=1e-6):
            raise ValueError("must be a whole number of milliseconds, as SUMO's clock")
        return round(value, 3)

    @field_validator("traffic", mode="before")
    @classmethod
    def _densities(cls, value: Any) -> Any:
        """One number for cars and pedestrians or two, as numbers or as text with a comma."""
        return None if value is None else densities(value)

    @field_validator("assertion_params", mode="before")
    @classmethod
    def _of_one(cls, value: Any) -> Any:
        """``NAME.KEY`` for one of several assertions, in TOML also as a table of its own."""
        return qualified(value)

    @field_validator("ego_sensor", "tester_sensor")
    @classmethod
    def _full_observability(cls, value: Sensor | None) -> Sensor | None:
        """A sensor that changes nothing is none."""
        return None if value == Sensor() else value

    @field_validator("ego_route", mode="before")
    @classmethod
    def _words(cls, value: Any) -> Any:
        """Edges or a turn as text, as on the command line."""
        return value.replace(",", " ").split() if isinstance(value, str) else value

    @property
    def name(self) -> str:
        """The network's name without its endings."""
        return self.net.name.removesuffix(".gz").removesuffix(".xml").removesuffix(".net")

    @property
    def net_file(self) -> Path:
        """The network's file, on this machine."""
        return network_file(self.net)

    @property
    def routes_file(self) -> Path | None:
        """The file of the background demand, on this machine."""
        return None if self.routes is None else routes_file(self.routes)


class BatchPlan(BaseModel):
    """How a scenario is played: by which agents, how often, from which seed."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    scenario: Scenario
    agents: tuple[str, ...] = Field(
        ("timing",), min_length=1, description="names of agents, or LABEL=NAME"
    )
    params: Params = Field(default_factory=dict)
    known: dict[str, tuple[Any, ...]] | None = Field(
        None,
        description="what agents know at the beginning of every episode, by label: then nobody "
        "learns from one episode for the next",
    )
    runs: int = Field(100, ge=1, le=10_000_000)
    seed: int = Field(1, ge=0, le=2**63 - 1)
    trace: Literal["none", "tests", "all"] = "tests"
    deadline_s: Finite = Field(120.0, gt=0)
    reset: Literal["fresh", "shared"] = Field(
        "fresh",
        description="begin every episode in a simulation of its own, or search in a shared one and "
        "play what was found again in its own",
    )
    reference: Literal["none", "ideal", "human", "rss"] = Field(
        "human", description="the driver who might have avoided a violation"
    )
    shard: str | None = Field(None, description="part I/N of the episodes, I from 1 to N")
    first: bool = Field(False, description="stop at the first failure")
    until_tests: int | None = Field(None, ge=1, description="stop after so many tests")
    until_half_width: str | None = Field(
        None, description="stop when the rate's interval is that narrow: 0.02, or 10% of the rate"
    )
    until_rate: Literal["tests", "failures"] = Field(
        "tests", description="the rate meant: tests among episodes, or failures among tests"
    )
    budget_s: Finite | None = Field(None, gt=0, description="stop after so much real time [s]")

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

    @field_validator("agents")
    @classmethod
    def _told_apart(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        cast_of(value)
        return value

    @property
    def cast(self) -> dict[str, str]:
        """The names of the agents by their labels, in the order in which they take turns."""
        return cast_of(self.agents)

    @property
    def block(self) -> int:
        """How many episodes in a row share one simulation, and are played by one process."""
        return SHARED_BY if self.reset == "shared" else 1

    def todo(self) -> Iterator[int]:
        """The numbers of the episodes, those of the shard only if there is one.

        Shards take turns, with one episode of all agents or with the episodes that share one
        simulation, so that an episode is the same in every shard.
        """
        part, parts = part_of(self.shard) if self.shard else (1, 1)
        total, turn = self.runs * len(self.agents), max(self.block, len(self.agents))
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


def qualified(params: Any) -> Any:
    """Parameters with those of inner tables under their full names, ``TABLE.KEY``."""
    if not isinstance(params, Mapping):
        return params
    flat: dict[str, Any] = {}
    for key, value in params.items():
        inner = isinstance(value, Mapping)
        flat |= {f"{key}.{k}": v for k, v in value.items()} if inner else {key: value}
    return flat


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


SCENARIO_KEYS = frozenset(Scenario.model_fields)
PLAN_KEYS = frozenset(BatchPlan.model_fields) - {"scenario"}
SENSOR_KEYS = ("ego_sensor", "tester_sensor")


def plan_from(settings: Mapping[str, Any], source: str) -> BatchPlan:
    """Validate flat settings (from a file, the command line or both) into a plan.

    A route file that lies beside the network (``routes/NAME.rou.xml`` next to its folder) is
    found when none is named and no traffic is to be drawn; ``routes = "none"`` keeps the roads
    empty.
    """
    check_keys(settings, source)
    if "net" not in settings:
        raise InputError(f"{source}: no network given; name one with --net FILE")
    for key in ("net", "routes"):
        if not isinstance(settings.get(key, ""), str | Path):
            raise InputError(f"{source}: {key}: expected a path, got {shown(settings[key])}")
    check_network(Path(settings["net"]), source)
    scenario = {k: v for k, v in settings.items() if k in SCENARIO_KEYS}
    if str(scenario.get("traffic")) == "none":
        del scenario["traffic"]
    scenario["routes"] = _route_file(scenario, source)
    try:
        plan = BatchPlan(
            scenario=Scenario(**scenario),
            **{k: v for k, v in settings.items() if k in PLAN_KEYS},
        )
    except ValidationError as error:
        raise InputError(f"{source}: {first_problem(error, 'scenario')}") from error
    for file in (plan.scenario.routes_file, *plan.scenario.additional):
        if file is not None and not file.is_file():
            raise InputError(f"{source}: no such file: {str(file)!r}")
    if plan.shard and (plan.first or plan.until_tests or plan.until_half_width):
        raise InputError(
            f"{source}: a shard sees its own rows only; first, until_tests and until_half_width "
            "need the whole batch"
        )
    if plan.scenario.testers % plan.scenario.bodies_per_agent:
        raise InputError(
            f"{source}: bodies_per_agent {plan.scenario.bodies_per_agent} does not divide "
            f"testers {plan.scenario.testers}"
        )
    return plan


def check_keys(settings: Mapping[str, Any], source: str) -> None:
    """Refuse keys that no setting has."""
    for key in settings:
        if key not in SCENARIO_KEYS | PLAN_KEYS:
            raise UnknownName("key", key, SCENARIO_KEYS | PLAN_KEYS, source)
    for sensor in SENSOR_KEYS:
        given = settings.get(sensor)
        for key in given if isinstance(given, Mapping) else ():
            if key not in Sensor.model_fields:
                raise UnknownName(f"key of {sensor}", key, Sensor.model_fields, source)


def _route_file(scenario: Mapping[str, Any], source: str) -> Path | None:
    """The route file named, the one belonging to the network, or None.

    Traffic that is drawn takes the place of the one that would be found, not of one that is named.
    """
    given, drawn = scenario.get("routes"), scenario.get("traffic") is not None
    if given is not None and str(given) != "none" and drawn:
        raise InputError(
            f"{source}: traffic comes from routes {str(given)!r} or is drawn with traffic "
            f"{scenario['traffic']!r}, not both; routes none or traffic none leaves one"
        )
    if given is not None or drawn:
        return None if given is None or str(given) == "none" else Path(given)
    net = Path(scenario["net"])
    if is_named(net):
        return routes_of(net)
    stem = net.name.removesuffix(".gz").removesuffix(".xml").removesuffix(".net")
    for folder in (net.parent.parent / "routes", net.parent):
        file = folder / f"{stem}.rou.xml"
        if file.is_file():
            return file
    return None
