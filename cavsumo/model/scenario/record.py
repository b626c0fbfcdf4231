"""The record of one test scenario.

A field here is a setting everywhere: an option of ``cavsumo run``, a key of a scenario file, a
keyword of the environments, a row of the table in ``docs/settings.md``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, field_validator, model_validator

from cavsumo.model.checks import densities
from cavsumo.model.named_networks import DEFAULT, network_file, routes_file
from cavsumo.model.scenario.option import Option
from cavsumo.model.scenario.params import Params, qualified
from cavsumo.model.scenario.sensor import Finite, Sensor
from cavsumo.model.vocabulary import ApproachType, Signal


class Scenario(BaseModel):
    """One test scenario; every field has its unit in its description.

    Its files are named as they were given, wherever they are now (``placed``): manifests and traces
    do not depend on that.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)
    _places: Mapping[str, Path] = PrivateAttr(default_factory=dict)

    net: Annotated[
        Path,
        Option("scenario", ("-n", "--net", "--net-file"), "NET", DEFAULT, choices="network"),
    ] = Field(
        description="SUMO network: a .net.xml or .net.xml.gz, a .sumocfg that names one, or one "
        "of cavsumo's by name"
    )
    routes: Annotated[
        Path | None,
        Option(
            "scenario",
            ("-r", "--routes", "--route-files"),
            "FILE",
            "routes/NAME.rou.xml when it exists and no traffic is drawn",
        ),
    ] = Field(
        None,
        description="background demand: a .rou.xml, the name of a network of cavsumo's for its "
        "demand, or none for empty roads",
    )
    traffic: Annotated[
        tuple[float, float] | None, Option("scenario", metavar="DENSITY", unset="not drawn")
    ] = Field(
        None,
        description="background cars and pedestrians drawn for the network instead of routes: "
        "departures per minute and kilometre, of cars on roads, each direction counted, and of "
        "pedestrians on pavements; 4 for both, 4,2 for each, or none",
    )
    traffic_seed: Annotated[int | None, Option("scenario", metavar="SEED", unset="the batch's")] = (
        Field(None, ge=0, le=2**63 - 1, description="seed that the traffic is drawn from")
    )
    additional: Annotated[
        tuple[Path, ...],
        Option("scenario", ("-a", "--additional-files"), "FILES", separator=","),
    ] = Field((), description="SUMO additional files")
    end: Annotated[Finite, Option("scenario", ("-e", "--end"), "S")] = Field(
        60.0, gt=0, le=36000, description="horizon of an episode [s]"
    )
    step_length: Annotated[Finite, Option("scenario", metavar="S")] = Field(
        0.1, ge=0.001, le=1, description="timestep lambda [s]"
    )
    ego: Annotated[str, Option("ego", metavar="NAME", choices="ego")] = Field(
        "sumo",
        description="vehicle under test: an ego by name (cavsumo egos), module:Class, "
        "exec:COMMAND or tcp:HOST:PORT",
    )
    ego_params: Annotated[Params, Option("ego", ("--ego-param",), "KEY=VALUE")] = Field(
        default_factory=dict, description="a parameter of the ego"
    )
    ego_sensor: Annotated[
        Sensor | None,
        Option("ego", metavar="KEY=VALUE", unset="everybody, exactly, at once"),
    ] = Field(None, description="what the ego sees of the others")
    ego_route: Annotated[
        tuple[str, ...],
        Option("ego", metavar="ROUTE", unset="the best way", separator=", "),
    ] = Field(
        (),
        description="edges of the ego's route, with commas or spaces; or straight, left, right, "
        "u-turn: the best such way through the junction under test",
    )
    junction: Annotated[str | None, Option("ego", metavar="ID", unset="the best one")] = Field(
        None, description="junction under test"
    )
    signal: Annotated[Signal, Option("ego")] = Field(
        "any",
        description="what the ego meets at the first traffic light on its route when nothing "
        "hinders it",
    )
    assertions: Annotated[
        tuple[str, ...], Option("assertions", ("--assert",), "NAME", choices="assertion")
    ] = Field(
        ("reaction-zone",),
        min_length=1,
        description="what the ego must keep: an assertion by name (cavsumo assertions), "
        "module:function or a formula's name; all formulas if only those are given",
    )
    assertion_params: Annotated[Params, Option("assertions", ("--assert-param",), "KEY=VALUE")] = (
        Field(default_factory=dict, description="a parameter of the assertions that have it")
    )
    formulas: Annotated[dict[str, str], Option("assertions", ("--formula",), "NAME=TEXT")] = Field(
        default_factory=dict,
        description="temporal logic that the ego must keep too, such as 'apart=always (gap_m > "
        "0.5)' (docs/formulas.md)",
    )
    testers: Annotated[int, Option("testers", metavar="N")] = Field(
        3, ge=1, le=100, description="number of tester bodies"
    )
    kind: Annotated[str, Option("testers", choices="kind of body")] = Field(
        "pedestrian", description="kind of the tester bodies"
    )
    approaches: Annotated[
        tuple[ApproachType, ...], Option("testers", ("--approach",), unset="all of them")
    ] = Field((), description="type of approach on which tester vehicles start")
    jaywalk: Annotated[bool, Option("testers")] = Field(
        False,
        description="testers start anywhere beside the road, also where there is no pavement",
    )
    bodies_per_agent: Annotated[int, Option("testers", metavar="N")] = Field(
        1, ge=1, description="bodies that one agent owns"
    )
    tester_sensor: Annotated[
        Sensor | None,
        Option("testers", metavar="KEY=VALUE", unset="everybody, exactly, at once"),
    ] = Field(None, description="what the tester agents see of the others")
    starts_seed: Annotated[
        int | None, Option("testers", metavar="SEED", unset="each draws its own")
    ] = Field(
        None,
        ge=0,
        le=2**32 - 1,
        description="seed of an episode whose testers' starts all episodes have",
    )
    start_speed: Annotated[Finite | None, Option("testers", metavar="V", unset="their maximum")] = (
        Field(None, ge=0, description="speed of the testers at the start [m/s]")
    )
    embodiment: Annotated[Literal["vehicle", "person"], Option("testers")] = Field(
        "vehicle", description="how SUMO is shown a tester pedestrian"
    )
    sumo_width: Annotated[Finite, Option("testers", metavar="M")] = Field(
        0.05, ge=0.01, le=5, description="width that SUMO is shown of a tester pedestrian [m]"
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

    def placed(self, places: Mapping[str, Path]) -> Scenario:
        """The same scenario with the present paths of some of its files, by their names."""
        again = self.model_copy()
        again._places = {**self._places, **places}
        return again

    @property
    def places(self) -> Mapping[str, Path]:
        """The present paths of files that have moved, by their names."""
        return self._places

    def present(self, file: Path) -> Path:
        """The present path of a file that the scenario or an agent names."""
        return self._places.get(str(file), file)

    @property
    def net_file(self) -> Path:
        """The network's file, on this machine."""
        return self._places.get(str(self.net)) or network_file(self.net)

    @property
    def routes_file(self) -> Path | None:
        """The file of the background demand, on this machine."""
        if self.routes is None:
            return None
        return self._places.get(str(self.routes)) or routes_file(self.routes)

    @property
    def additional_files(self) -> tuple[Path, ...]:
        """SUMO's additional files, on this machine."""
        return tuple(map(self.present, self.additional))
