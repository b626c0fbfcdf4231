"""The texts of the page about an episode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cavsumo.assertions.base import HELD, INVALID, UNFAIR, VIOLATED
from cavsumo.batch.replay import Record
from cavsumo.egos import EGOS
from cavsumo.egos.reference import IDEAL
from cavsumo.model.scenario import Scenario
from cavsumo.results.traces import Trace


def headline(record: Record) -> str:
    """The page's title."""
    return f"Run {record.run} ({record.row['agent']}), {record.plan.scenario.name}"


def verdict(row: Mapping[str, str]) -> str:
    """The result of the episode, as a sentence."""
    outcome, tester = row["outcome"], row["tester"] or "a tester"
    triggered = f"{row['assertion']} was triggered by {tester} at {_short(row['trigger_time_s'])} s"
    if outcome == VIOLATED and row["impact_speed_mps"]:
        when, speed = _short(row["violation_time_s"]), _short(row["impact_speed_mps"])
        return f"The ego hit {tester} at {when} s, closing at {speed} m/s."
    if outcome == VIOLATED:
        return f"The ego violated {row['assertion']} at {_short(row['violation_time_s'])} s."
    if outcome == HELD:
        return f"The ego passed the test: {triggered}."
    if outcome == UNFAIR:
        return f"No fair test: the ego could not have avoided {tester}."
    if outcome == INVALID:
        return f"Not valid: {row['breach']}."
    return "No test: the precondition of the assertion never held."


def marks(row: Mapping[str, str]) -> list[dict[str, Any]]:
    """The marked moments: trigger and violation, in seconds."""
    named = (("trigger", "trigger_time_s"), ("violation", "violation_time_s"))
    return [{"name": name, "time": float(row[key])} for name, key in named if row[key]]


def facts(record: Record, trace: Trace) -> list[tuple[str, str]]:
    """The identity of the episode, and its figures."""
    row, scenario = record.row, record.plan.scenario
    found = [
        ("Network", scenario.net.name),
        ("Junction", scenario.junction or ""),
        ("Traffic", traffic_words(scenario)),
        ("Ego", ego_words(scenario)),
        ("Tester agent", row["agent"]),
        ("Parameters", " ".join(f"{k}={v}" for k, v in record.plan.params.items())),
        ("Testers", f"{row['testers']} ({scenario.kind})"),
        ("Assertion", " ".join(scenario.assertions)),
        ("Outcome", row["outcome"].replace("_", " ")),
        ("Tester involved", row["tester"]),
        ("Preventable", _preventable(row)),
        ("Blame", row.get("blame", "")),
        ("Breach", row.get("breach", "")),
        ("Trigger", _with(row["trigger_time_s"], "s")),
        ("Violation", _with(row["violation_time_s"], "s")),
        ("Impact speed", _with(row["impact_speed_mps"], "m/s")),
        ("Smallest gap", _with(row["min_gap_m"], "m")),
        ("Hardest braking", _with(row["max_decel_mps2"], "m/s²")),
        ("Length", _with(row["time_s"], "s")),
        ("Run", f"{row['run']}, seed {row['seed']} of batch seed {record.plan.seed}"),
        ("Versions", ", ".join(f"{k} {v}" for k, v in trace.head["versions"].items())),
    ]
    return [(term, text) for term, text in found if text]


def _preventable(row: Mapping[str, str]) -> str:
    """Whether the reference drivers would have avoided it; empty if that was not judged."""
    reference = row.get("reference", "")
    asked = {reference: row.get("avoidable", "")}
    if reference != IDEAL:
        asked[IDEAL] = row.get("avoidable_ideal", "")
    answers = {driver: {"1": "yes", "0": "no"}.get(cell) for driver, cell in asked.items()}
    return "; ".join(f"{said}, by the driver {who!r}" for who, said in answers.items() if said)


def ego_words(scenario: Scenario) -> str:
    """The ego with its parameters: those that were given or, for SUMO's driver, all."""
    params = scenario.ego_params
    if scenario.ego in EGOS:  # an external one is not built here
        params = getattr(EGOS.make(scenario.ego, params), "attributes", params)
    return " ".join((scenario.ego, *(f"{k}={v}" for k, v in params.items())))


def traffic_words(scenario: Scenario) -> str:
    """The source of the background traffic."""
    if scenario.traffic is not None:
        return "drawn, {:g},{:g} per minute and km".format(*scenario.traffic)
    return scenario.routes.name if scenario.routes else "none"


def _with(value: str, unit: str) -> str:
    """A figure with its unit, nothing for none."""
    return f"{value} {unit}" if value else ""


def _short(value: str) -> str:
    """A figure to one decimal."""
    return f"{float(value):.1f}" if value else "?"
