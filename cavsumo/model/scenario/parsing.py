"""Flat settings, from a file, the command line or keywords, validated into a plan."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from cavsumo.errors import InputError, UnknownName, plain, shown
from cavsumo.model.documents import first_problem
from cavsumo.model.gone_settings import GONE
from cavsumo.model.named_networks import check_network, is_named, named_routes, routes_of
from cavsumo.model.scenario.fields import settings as offered
from cavsumo.model.scenario.plan import BatchPlan
from cavsumo.model.scenario.record import Scenario
from cavsumo.model.scenario.sensor import Sensor
from cavsumo.model.sumo_configuration import with_configuration
from cavsumo.model.visible_files import is_visible

SCENARIO_KEYS = frozenset(Scenario.model_fields)
SCRIPTED = "scripted"  # the agent that plays scripts, and nothing else
PLAN_KEYS = frozenset(BatchPlan.model_fields) - {"scenario"}
SENSOR_KEYS = ("ego_sensor", "tester_sensor")


def plan_from(
    settings: Mapping[str, Any], source: str, places: Mapping[str, Path] | None = None
) -> BatchPlan:
    """Validate flat settings (from a file, the command line or both) into a plan.

    ``places``: the present paths of files that results name (``Scenario.placed``).

    A route file that lies beside the network (``routes/NAME.rou.xml`` next to its folder) is
    found when none is named and no traffic is to be drawn; ``routes = "none"`` keeps the roads
    empty. A SUMO configuration in place of a network gives network, routes and additional files.
    """
    check_keys(settings, source)
    if "net" not in settings:
        raise InputError(f"{source}: no network given; name one with --net FILE")
    for key in ("net", "routes"):
        if not isinstance(settings.get(key, ""), str | Path):
            raise InputError(f"{source}: {key}: expected a path, got {shown(settings[key])}")
    settings = with_configuration(settings, source)
    places = places or {}
    if str(settings["net"]) not in places:
        check_network(Path(settings["net"]), source)
    scenario = {k: v for k, v in settings.items() if k in SCENARIO_KEYS}
    if str(scenario.get("traffic")) == "none":
        del scenario["traffic"]
    scenario["routes"] = _route_file(scenario, places, source)
    scripted = settings.get("script") or settings.get("suite")
    if scripted and not settings.get("agents"):
        settings = {**settings, "agents": (SCRIPTED,)}
    try:
        plan = BatchPlan(
            scenario=Scenario(**scenario).placed(places),
            **{k: v for k, v in settings.items() if k in PLAN_KEYS},
        )
    except ValidationError as error:
        raise _first_problem(error, source) from error
    _check_together(plan, source)
    return plan


def _check_together(plan: BatchPlan, source: str) -> None:
    """Refuse files that are not there, and settings that do not go together."""
    for file in (plan.scenario.routes_file, *plan.scenario.additional_files):
        try:
            if file is not None and not file.is_file():
                raise InputError(f"{source}: no such file: {str(file)!r}")
        except OSError as error:
            raise InputError(f"{source}: {plain(error)}") from error
    if plan.shard and (plan.first or plan.until_tests or plan.until_half_width):
        raise InputError(
            f"{source}: a shard sees its own rows only; first, until_tests and until_half_width "
            "need the whole batch"
        )
    scripted = plan.scenario.script is not None or plan.suite is not None
    if scripted != (SCRIPTED in plan.cast.values()) or (scripted and len(plan.cast) > 1):
        raise InputError(
            f"{source}: agent {SCRIPTED} plays scripts and suites, and no other agent does; got "
            f"{' '.join(plan.agents)}"
        )
    check_teams(plan.scenario, source)


def check_teams(scenario: Scenario, source: str) -> None:
    """Refuse testers that cannot be divided among agents."""
    if scenario.testers % scenario.bodies_per_agent:
        raise InputError(
            f"{source}: bodies_per_agent {scenario.bodies_per_agent} does not divide "
            f"testers {scenario.testers}"
        )


def check_keys(settings: Mapping[str, Any], source: str) -> None:
    """Refuse keys that no setting has."""
    for key in settings:
        if key in GONE:
            raise InputError(f"{source}: {key}: {GONE[key].words}")
        if key not in SCENARIO_KEYS | PLAN_KEYS:
            raise UnknownName("key", key, SCENARIO_KEYS | PLAN_KEYS, source)
    for sensor in SENSOR_KEYS:
        given = settings.get(sensor)
        for key in given if isinstance(given, Mapping) else ():
            if key not in Sensor.model_fields:
                raise UnknownName(f"key of {sensor}", key, Sensor.model_fields, source)


def _route_file(
    scenario: Mapping[str, Any], places: Mapping[str, Path], source: str
) -> Path | None:
    """The route file named, the one belonging to the network, or None.

    Traffic that is drawn takes the place of the one that would be found, not of one that is named.
    """
    given, drawn = scenario.get("routes"), scenario.get("traffic") is not None
    if given is not None and str(given) != "none" and drawn:
        raise InputError(
            f"{source}: traffic comes from routes {str(given)!r} or is drawn with traffic "
            f"{shown(scenario['traffic'])}, not both; routes none or traffic none leaves one"
        )
    if given is not None or drawn:
        if given is None or str(given) == "none":
            return None
        return Path(given) if str(given) in places else named_routes(Path(given), source)
    net = Path(scenario["net"])
    if is_named(net):
        return routes_of(net)
    stem = net.name.removesuffix(".gz").removesuffix(".xml").removesuffix(".net")
    for folder in (net.parent.parent / "routes", net.parent):
        file = folder / f"{stem}.rou.xml"
        if is_visible(file):
            return file
    return None


def _first_problem(error: ValidationError, source: str) -> InputError:
    """The first of pydantic's findings as one sentence; a wrong word with the nearest valid one."""
    problem = error.errors()[0]
    place = ".".join(str(p) for p in problem["loc"] if p not in ("scenario",))
    given, key = problem["input"], problem["loc"][0]
    if problem["type"] == "literal_error" and isinstance(given, str):
        words = next((s.words for s in offered() if s.key == key), ())
        return UnknownName("value", given, words, f"{source}: {place}")
    return InputError(f"{source}: {first_problem(error, 'scenario')}")
