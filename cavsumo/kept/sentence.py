"""A kept test in a sentence: what each tester does, and what the ego does then."""

from __future__ import annotations

import math
from collections.abc import Mapping

from cavsumo.batch.sentences import driver, many
from cavsumo.kept.candidate import Candidate
from cavsumo.kept.motion import BodyMotion
from cavsumo.model.bodies import WALKING
from cavsumo.model.scenario import BatchPlan

TOWARDS = ("east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east")


def in_words(plan: BatchPlan, row: Mapping[str, str], candidate: Candidate) -> str:
    """The test and its result, as one sentence.

    Args:
        plan: of the test.
        row: of the episode, as text.
        candidate: what the test consists of.
    """
    scenario, bodies = plan.scenario, candidate.motions
    dt, alone = scenario.step_length, len(bodies) == 1
    names = [f"a {scenario.kind}"] if alone else [f"tester{i}" for i in range(len(bodies))]
    testers = "; ".join(
        _tester(n, m, dt, scenario.kind) for n, m in zip(names, bodies, strict=True)
    )
    there = len(candidate.background)
    traffic = f", among {there} of the background" if there else ""
    entry = candidate.entry
    enters = "" if entry is None else f"enters at {entry.speed:.3g} m/s and "
    who = "it" if alone and row["tester"] == "tester0" else row["tester"] or "nobody"
    return (
        f"On {scenario.name}{traffic}, {testers}; ego {scenario.ego} {enters}"
        f"{_result(row, who)}{_judged(row)}."
    )


def _tester(name: str, motion: BodyMotion, dt: float, kind: str) -> str:
    """The motion of a tester in words."""
    start = f"{name} at ({motion.start.x:.6g}, {motion.start.y:.6g})"
    if not motion.legs:
        return f"{start} moves as recorded, in {many(motion.segments, 'segment')}"
    verb = "walks" if kind in WALKING else "drives"
    way = "along its track" if motion.way else f"straight to the {_direction(motion.start.o)}"
    said = []
    ends = [f" until {leg.step * dt:g} s" for leg in motion.legs[1:]]
    for leg, until in zip(motion.legs, [*ends, ""], strict=True):
        moves = f"{verb} {way} at {leg.speed:g} m/s" if leg.speed > 0.0 else "stands"
        said.append(f"{moves}{until}")
    return f"{start} {', then '.join(said)}"


def _direction(o: float) -> str:
    """A heading as a direction of the compass."""
    return TOWARDS[round(o / (math.pi / 4)) % len(TOWARDS)]


def _result(row: Mapping[str, str], who: str) -> str:
    """The part of the ego; of an episode without a violation only the outcome."""
    if row["outcome"] != "violated":
        return f"meets {who}: {row['outcome'].replace('_', ' ')}"
    when = float(row["violation_time_s"])
    if row["impact_speed_mps"]:
        speed = float(row["impact_speed_mps"])
        return f"hits {who} at {when:.1f} s, closing at {speed:.1f} m/s"
    return f"violates {row['assertion']} at {when:.1f} s"


def _judged(row: Mapping[str, str]) -> str:
    """The judgement of the reference driver."""
    if not row["avoidable"]:
        return ""
    would = "would have avoided that" if row["avoidable"] == "1" else "would not have avoided it"
    return f"; {driver(row['reference'])} {would}"
