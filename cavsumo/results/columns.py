"""The columns of results.csv, each one entry: its name, meaning, unit and value.

The row, the header, the explanations in the manifest and the table of docs/results.md are made
from ``COLUMNS``; readers of results use the names of this list.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from cavsumo.assertions.judgement import INVALID, VIOLATED, Judgement
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.results.column import Column, FinishedEpisode, Measured
from cavsumo.results.grade import grade

if TYPE_CHECKING:
    from cavsumo.agents.base import Forecast
    from cavsumo.simulation.avoidability import Avoidability
    from cavsumo.simulation.ego_progress import EgoProgress
    from cavsumo.simulation.episode import Episode
    from cavsumo.simulation.tester_course import TesterCourse

Row = dict[str, Any]


def row_of(finished: FinishedEpisode) -> Row:
    """The row of an episode, by column."""
    return {name: column.value(finished) for name, column in COLUMNS.items()}


def measured(episode: Episode) -> Row:
    """The columns that an episode fills by itself."""
    return {
        name: column.value.of(episode)
        for name, column in COLUMNS.items()
        if isinstance(column.value, Measured)
    }


def markdown_table() -> str:
    """All columns as the table of docs/results.md."""
    lines = ["| column | unit | meaning |", "| --- | --- | --- |"]
    lines += [f"| `{c.name}` | {c.unit} | {c.meaning} |" for c in COLUMNS.values()]
    return "".join(f"{line}\n" for line in lines)


# Values


def _judgement(episode: Episode) -> Judgement:
    """The judgement of the row; for an invalid episode only the responsible tester.

    The assertions' own verdicts are in ``verdicts``.
    """
    if episode.invalid and episode.breach:
        return Judgement("", INVALID, episode.breach.tester)
    return episode.judgement


def _judged(value: Callable[[Judgement], Any], unplayed: Any = None) -> Measured:
    """A value of the judgement."""
    return Measured(lambda episode: value(_judgement(episode)), unplayed)


def _robustness(said: Judgement) -> float | None:
    """The robustness for the CSV: rounded, but negative for a violation."""
    value = said.robustness
    return min(value, -0.001) if value is not None and said.verdict == VIOLATED else value


def verdicts_cell(verdicts: Mapping[str, str]) -> str:
    """All verdicts as one cell; ``rows.verdicts_of`` parses it."""
    return " ".join(f"{name}={verdict}" for name, verdict in verdicts.items())


def parameters_cell(parameters: Mapping[str, Any]) -> str:
    """Parameters as one cell; ``rows.parameters_of`` parses it."""
    said = {k: f"{v:.6g}" if isinstance(v, float) else str(v) for k, v in parameters.items()}
    return " ".join(f"{name}={value}" for name, value in said.items())


def _scripted(value: Callable[[ScriptedTest], str]) -> Callable[[FinishedEpisode], Any]:
    """A value of the script; empty for an episode without one."""

    def cell(done: FinishedEpisode) -> str | None:
        script = done.plan.scenario.script
        return None if script is None else value(script)

    return cell


def _foretold(value: Callable[[Forecast], Any], none: Any = None) -> Measured:
    """A value of the tester's forecast."""
    return Measured(lambda episode: value(episode.forecast) if episode.forecast else none)


def _with_ego(episode: Episode) -> int:
    """The number of collisions with the ego that SUMO reported."""
    return sum("ego" in pair for pair in episode.sumo_collisions)


def _driven(value: Callable[[EgoProgress], Any]) -> Measured:
    """A value of the ego's drive."""
    return Measured(lambda episode: value(episode.progress))


def _coming(value: Callable[[TesterCourse], Any]) -> Measured:
    """A value of the course of the tester that was met."""
    return Measured(lambda e: None if e.course is None else value(e.course))


def _retried(value: Callable[[Avoidability], Any]) -> Callable[[FinishedEpisode], Any]:
    """A value of the judgement by the reference driver."""
    return lambda done: None if done.avoidability is None else value(done.avoidability)


def _avoidable(found: Avoidability) -> int | None:
    """Whether the reference driver would have avoided the violation, as 1 or 0."""
    return None if found.avoidable is None else int(found.avoidable)


def _later(_: FinishedEpisode) -> None:
    """None: the value is known only when the row is written."""


_ALL = (
    Column(
        "run", "number of the episode in the batch, from 0; the key for replay", "", lambda f: f.run
    ),
    Column("agent", "tester agent", "", lambda f: f.agent, words=True),
    Column("ego", "vehicle under test", "", lambda f: f.plan.scenario.ego, words=True),
    Column("testers", "number of tester bodies", "", lambda f: f.plan.scenario.testers),
    Column(
        "case",
        "the case of a suite, as TEST/ego speed/...; empty outside of suites",
        "",
        _scripted(lambda script: script.name),
        words=True,
        since="0.2",
    ),
    Column(
        "parameters",
        "its parameters: NAME=VALUE, with blanks between; variation 0 is the case as published",
        "",
        _scripted(lambda script: parameters_cell(script.parameters)),
        words=True,
        since="0.2",
    ),
    Column(
        "reset",
        "fresh: in a simulation of its own, always since 0.2; shared: in one that other episodes "
        "used before",
        "",
        lambda _: "fresh",
        words=True,
    ),
    Column(
        "embodiment",
        "how SUMO was shown the testers: vehicle or person",
        "",
        lambda f: f.plan.scenario.embodiment,
        words=True,
    ),
    Column(
        "sumo_width_m",
        "width that SUMO was shown of a tester pedestrian",
        "m",
        lambda f: f.plan.scenario.sumo_width,
    ),
    Column(
        "seed",
        "the episode's seed, derived from the batch's seed and the number of the episode",
        "",
        lambda f: f.seed,
    ),
    Column(
        "forecast",
        "what the tester said before the episode: sure, undecided or not-forceable; empty for "
        "agents that say nothing",
        "",
        _foretold(lambda said: said.verdict, ""),
        words=True,
    ),
    Column(
        "forecast_value",
        "value of its game at the start: 0 where a test is sure, -1 where there is none",
        "",
        _foretold(lambda said: said.value),
    ),
    Column(
        "outcome",
        "violated, held, not_triggered, unfair, invalid or error",
        "",
        _judged(lambda said: said.verdict, unplayed="error"),
        words=True,
    ),
    Column(
        "breach",
        "which tester broke which rule of the world before the verdict, and when: the one that "
        "makes the episode invalid, else the first",
        "",
        Measured(lambda episode: str(episode.breach or "")),
        words=True,
    ),
    Column(
        "blame",
        "which party broke which rule first when outcome is violated, as PARTY:rule; a hint, not "
        "law (docs/fairness.md); empty if no rule tells",
        "",
        Measured(lambda episode: episode.blame),
        words=True,
    ),
    Column(
        "assertion",
        "the assertion first violated, else first triggered; one without a precondition only if "
        "violated or alone",
        "",
        _judged(lambda said: said.assertion if said.triggered else ""),
        words=True,
    ),
    Column(
        "verdicts",
        "what every assertion said: NAME=verdict, with blanks between",
        "",
        Measured(lambda episode: verdicts_cell(episode.verdicts)),
        words=True,
    ),
    Column(
        "robustness",
        "smallest margin of that assertion since its trigger, in its unit (docs/assertions.md); "
        "negative if and only if violated",
        "",
        _judged(_robustness),
    ),
    Column(
        "tester", "the tester's body involved", "", _judged(lambda said: said.tester), words=True
    ),
    Column(
        "from_side",
        "from which side of the ego's path that tester came, left, right or ahead; without one, "
        "the tester that came nearest",
        "",
        _coming(lambda course: course.side),
        words=True,
        since="0.2",
    ),
    Column(
        "meets_m",
        "where on the ego's path its way across meets it; of a vehicle, beside which place it "
        "started",
        "m",
        _coming(lambda course: course.meets),
        since="0.2",
    ),
    Column(
        "tester_speed_mps",
        "its mean speed while it moved on the road",
        "m/s",
        _coming(lambda course: course.speed),
        since="0.2",
    ),
    Column(
        "trigger_time_s",
        "when the precondition triggered",
        "s",
        _judged(lambda said: said.trigger_time),
    ),
    Column(
        "violation_time_s",
        "when the assertion was violated",
        "s",
        _judged(lambda said: said.violation_time),
    ),
    Column("time_s", "length of the episode", "s", Measured(lambda episode: episode.time)),
    Column("steps", "length of the episode in timesteps", "", Measured(lambda e: e.steps)),
    Column(
        "min_gap_m",
        "smallest gap between the ego and a tester",
        "m",
        Measured(lambda episode: episode.contacts.min_gap),
    ),
    Column(
        "min_ttc_s",
        "smallest time to collision of the moving ego and a tester at constant velocities, before "
        "the first contact; empty above 10 s",
        "s",
        Measured(lambda episode: episode.extremes.ttc),
    ),
    Column(
        "max_drac_mps2",
        "largest deceleration by which the ego just avoids that collision; 0 for none",
        "m/s²",
        Measured(lambda episode: episode.extremes.drac),
    ),
    Column(
        "pet_s",
        "post-encroachment time: how long after the one, ego or tester, left an area that both "
        "sweep the other came there; 0 if both were in it at once, empty above 10 s",
        "s",
        Measured(lambda episode: episode.extremes.pet),
    ),
    Column(
        "ego_speed_mps",
        "speed of the ego at the violation, else at the trigger",
        "m/s",
        _judged(lambda said: said.ego_speed),
    ),
    Column(
        "impact_speed_mps",
        "closing speed along the ego's heading at contact",
        "m/s",
        _judged(lambda said: said.impact_speed),
    ),
    Column(
        "max_decel_mps2",
        "hardest braking of the ego",
        "m/s²",
        Measured(lambda episode: episode.max_decel),
    ),
    Column(
        "arrived",
        "1 if the ego came to the end of its route, 0 if not although the episode lasted to its "
        "end; empty if a verdict ended the episode before, or that nobody could meet the ego any "
        "more",
        "",
        _driven(lambda ego: None if ego.arrived is None else int(ego.arrived)),
        since="0.2",
    ),
    Column(
        "driven_m",
        "how far the ego came along its route",
        "m",
        _driven(lambda ego: ego.driven),
        since="0.2",
    ),
    Column(
        "mean_speed_mps",
        "mean speed of the ego along its route",
        "m/s",
        _driven(lambda ego: ego.driven / ego.time if ego.time > 0.0 else None),
        since="0.2",
    ),
    Column(
        "lost_s",
        "time that the ego lost against a free drive to the same place: on an empty road, at the "
        "speed limits, without lights (docs/results.md); negative if it was faster; empty where a "
        "search ended the episode because nobody could meet the ego any more",
        "s",
        _driven(lambda ego: ego.lost),
        since="0.2",
    ),
    Column("stood_s", "how long the ego stood", "s", _driven(lambda ego: ego.stood), since="0.2"),
    Column(
        "frozen",
        "stood if the ego had been standing for 10 s or longer when the episode ended, crawled if "
        "it needed, while it moved, more than four times as long as the free drive; else empty",
        "",
        _driven(lambda ego: ego.frozen),
        words=True,
        since="0.2",
    ),
    Column(
        "avoidable",
        "1 if the reference driver would have avoided the violation, else 0; empty if not judged",
        "",
        _retried(_avoidable),
    ),
    Column(
        "avoidable_ideal",
        "1 if the ideal driver would have avoided it (full braking at once), else 0; empty if not "
        "judged",
        "",
        _retried(lambda found: None if found.by_ideal is None else int(found.by_ideal)),
        since="0.2",
    ),
    Column(
        "reference",
        "the reference driver",
        "",
        lambda f: f.avoidability and f.plan.reference,
        words=True,
    ),
    Column(
        "last_chance_s",
        "latest time at which it could have perceived the risk and avoided it; empty for never",
        "s",
        _retried(lambda found: found.last_chance),
    ),
    Column(
        "margin_s",
        "how long before the violation that is",
        "s",
        _retried(lambda found: found.margin),
    ),
    Column(
        "avoidable_note",
        "why it was not judged, or what to doubt",
        "",
        _retried(lambda found: found.note),
        words=True,
    ),
    Column(
        "grade",
        "how near the episode came to a preventable failure: from 0 on its impact speed, below 0 "
        "all others (docs/search.md)",
        "",
        lambda f: f.episode and grade(f.episode, f.avoidability),
        since="0.2",
    ),
    Column(
        "situations",
        "for each decision of a searched tester the situation: gap, closing speed and lateral "
        "place, in steps (docs/search.md)",
        "",
        Measured(lambda episode: episode.notes or None),
        words=True,
        since="0.2",
    ),
    Column(
        "cost",
        "time that the testers spent on the carriageway, together",
        "s",
        Measured(lambda episode: episode.cost),
    ),
    Column(
        "accel_rms_mps2",
        "root mean square of the testers' accelerations over all timesteps",
        "m/s²",
        Measured(lambda episode: episode.rms_acceleration),
    ),
    Column(
        "turning_rad",
        "how far the testers turned, to either side, together",
        "rad",
        Measured(lambda episode: episode.naturalness.turning),
    ),
    Column(
        "reward",
        "the testers' return, undiscounted",
        "",
        Measured(lambda episode: episode.reward),
    ),
    Column(
        "contacts",
        "bodies that touched the ego, standing or moving",
        "",
        Measured(lambda episode: len(episode.contacts.ego_pairs)),
    ),
    Column(
        "tester_contacts",
        "pairs of a tester and a body other than the ego that touched",
        "",
        Measured(lambda episode: len(episode.contacts.tester_pairs)),
    ),
    Column(
        "sumo_collisions",
        "pairs with the ego that SUMO itself reported as colliding",
        "",
        Measured(_with_ego),
    ),
    Column(
        "background_collisions",
        "pairs without the ego that SUMO itself reported",
        "",
        Measured(lambda episode: len(episode.sumo_collisions) - _with_ego(episode)),
    ),
    Column(
        "emergency_stops",
        "emergency stops that SUMO reported",
        "",
        Measured(lambda episode: episode.emergency_stops),
    ),
    Column(
        "teleports",
        "teleports that SUMO reported",
        "",
        Measured(lambda episode: episode.teleports),
    ),
    Column("trace", "frames, relative to this file", "", _later, words=True),
    Column("error", "what went wrong when outcome is error", "", lambda f: f.error, words=True),
    Column("wall_s", "real time; the only column that is not reproducible", "s", _later),
)

# In the order of the header.
COLUMNS: Mapping[str, Column] = {column.name: column for column in _ALL}
