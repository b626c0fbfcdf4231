"""The certified test: a policy of the testers, taken from results or named.

A run gives the policy that its agent followed then: its parameters, its knowledge before that
episode and, unless starts are drawn anew, the starts of its testers. All random numbers are drawn
anew: SUMO's, the agents' and the sensors'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cavsumo.agents.casting import params_of, resolve_cast, teams
from cavsumo.batch.certify.tested_names import check_test
from cavsumo.batch.jobs import Memory
from cavsumo.batch.planned import recorded_settings
from cavsumo.batch.playback import recording_of
from cavsumo.batch.replay import Record, known, prepared_again, replayed
from cavsumo.batch.worker import Worker
from cavsumo.errors import InputError, ResultsError
from cavsumo.model.carriageway import StartRecord
from cavsumo.model.scenario import BatchPlan, Params
from cavsumo.results.provenance import EXTENT
from cavsumo.results.traces import Trace

# Settings of results that do not belong to the test: agents, egos, numbers of runs, storage.
OTHERS = EXTENT - {"deadline_s"} | {
    *("agents", "params", "known", "seed", "shard", "reset", "trace"),
    *("ego", "ego_params", "starts_seed"),
}


@dataclass(frozen=True)
class Subject:
    """A test to certify.

    Attributes:
        words: its description.
        agent: the agent that plays it, as a plan names agents.
        params: the agent's parameters.
        known: its knowledge at the beginning of every episode, by label.
        starts_seed: the seed of the episode whose starts it keeps; None to draw them anew.
        starts: those starts, x, y and o of each tester's body, where they were recorded; drawn
            again, they must be the same.
        told: the starts that the agent knows and that are not drawn; empty for none.
        approaches: the types of approach among which theirs were numbered.
    """

    words: str
    agent: str
    params: Params
    known: Mapping[str, Memory] = field(default_factory=dict)
    starts_seed: int | None = None
    starts: Sequence[tuple[float, float, float]] | None = None
    told: Sequence[StartRecord] = ()
    approaches: Sequence[str] = ()


def of_run(record: Record, params: Params, *, kept: bool, open_loop: bool) -> Subject:
    """The test that was found in an episode.

    Args:
        params: parameters of the agent in place of its own.
        kept: its testers keep their recorded starts.
        open_loop: they repeat their recorded actions instead of those of their agent.
    """
    plan, label = record.plan, record.row["agent"]
    if label not in plan.cast:
        raise ResultsError(f"run {record.run} of {record.file}: no agent {label!r} in its manifest")
    words = f"run {record.run} of {record.file} ({label})"
    own: dict[str, Any] = {}
    if kept:
        own = {"starts_seed": starts_seed(record), "starts": _starts(record)}
    if open_loop:
        if params:
            raise InputError("--open-loop: the recorded actions have no parameters")
        again, played = f"run{record.run}", recording_of(record, _trace(record))
        memory = {again: played.memories(teams(plan.scenario))}
        own |= {"told": played.starts, "approaches": played.approaches}
        return Subject(f"{words}, open loop", f"{again}=recorded", {}, memory, **own)
    memory = {label: found} if (found := _known_before(record)) is not None else {}
    return Subject(words, _word(plan, label), params_of(plan, label) | params, memory, **own)


def of_policy(
    word: str, plan: BatchPlan, manifest: Mapping[str, Any], file: Path, params: Params
) -> Subject:
    """An agent by its label in results, or any other agent."""
    if word in plan.cast:
        learned = manifest.get("learned", {}).get(word) or (plan.known or {}).get(word)
        memory = {} if learned is None else {word: tuple(learned)}
        after = manifest.get("learned_after", {}).get(word)
        when = "" if after is None or not memory else f", as it knew after run {after}"
        words = f"agent {word} of {file}{when}"
        return Subject(words, _word(plan, word), params_of(plan, word) | params, memory)
    check_test(word, plan, file)
    return Subject(f"agent {word}", word, params, {})


def settings_of(
    subject: Subject, manifest: Mapping[str, Any], runs: int, seed: int
) -> dict[str, Any]:
    """The settings of a batch that plays a test in the scenario of results; all but the ego.

    Drawn background traffic belongs to the scenario, so it is kept.
    """
    settings = {k: v for k, v in recorded_settings(manifest).items() if k not in OTHERS} | {
        "agents": [subject.agent],
        "params": subject.params,
        "known": dict(subject.known),
        "runs": runs,
        "seed": seed,
        "trace": "none",
    }
    if subject.starts_seed is not None:
        settings["starts_seed"] = subject.starts_seed
    if subject.approaches:
        settings["approaches"] = list(subject.approaches)
    if settings.get("traffic") is not None:
        settings.setdefault("traffic_seed", manifest["plan"]["seed"])
    return settings


def starts_seed(record: Record) -> int:
    """The seed from which the starts of an episode were drawn."""
    own = record.plan.scenario.starts_seed
    return int(record.row["seed"]) if own is None else own


def _starts(record: Record) -> list[tuple[float, float, float]] | None:
    """The starts that were drawn for an episode's testers, if there is a trace.

    Where somebody stood when the ego entered, a tester waited at the drawn one and began elsewhere;
    a trace of format 1 tells only where it began.
    """
    if record.trace is None:
        return None
    if record.trace.has_recording:
        played = recording_of(record, record.trace)
        return [(start.x, start.y, start.o) for start in played.waited or played.starts]
    return [(x, y, o) for x, y, _, o in record.trace.frames[0]["testers"].values()]


def _word(plan: BatchPlan, label: str) -> str:
    """An agent by its name in the plan."""
    return label if plan.cast[label] == label else f"{label}={plan.cast[label]}"


def _known_before(record: Record) -> Memory | None:
    """The knowledge of an agent before an episode: from its trace, or by playing its earlier ones.

    Agents that neither learn nor search have none.
    """
    plan, label = record.plan, record.row["agent"]
    cast = resolve_cast(plan)
    if label not in cast.learners | cast.searchers:
        return (plan.known or {}).get(label)
    if record.trace is not None and record.trace.head.get("memory_kept"):
        memory = record.trace.head["memory"]
        return None if memory is None else tuple(memory)
    with Worker(prepared_again(record)) as worker:
        return known(worker, record)


def _trace(record: Record) -> Trace:
    """The trace of an episode; it is played again where none was kept."""
    if record.trace is not None:
        return record.trace
    with Worker(prepared_again(record)) as worker:
        again = replayed(worker, record)
    if again.trace is None:
        raise InputError(f"--open-loop: run {record.run} ended in an error: it has no actions")
    return again.trace
