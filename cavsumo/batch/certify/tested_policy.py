"""What is certified: a test as a policy of the testers, taken from results or named.

A run gives the policy that its agent followed then: its parameters and what it knew before that
episode, and (unless starts are to be fresh) where its testers started. Everything else is chance
and drawn anew: SUMO's, the agents' own, the sensors'.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cavsumo.agents import AGENTS
from cavsumo.agents.casting import params_of, resolve_cast, teams, tester_bodies
from cavsumo.agents.policy import policy_file
from cavsumo.agents.recorded import action_between
from cavsumo.batch.jobs import Memory
from cavsumo.batch.preflight import recorded_settings
from cavsumo.batch.replay import Record, known, prepared_again, replayed
from cavsumo.batch.worker import Worker
from cavsumo.errors import InputError, ResultsError, UnknownName
from cavsumo.model.labels import cast_of
from cavsumo.model.scenario import BatchPlan, Params
from cavsumo.results.provenance import EXTENT
from cavsumo.results.traces import Trace

# Settings of results that are not the test's: which agents, against whom, how often, how kept.
OTHERS = EXTENT - {"deadline_s"} | {
    *("agents", "params", "known", "seed", "shard", "reset", "trace", "reference"),
    *("ego", "ego_params", "starts_seed"),
}


@dataclass(frozen=True)
class Subject:
    """A test to certify.

    Attributes:
        words: what it is, for people.
        agent: who plays it, as a plan names agents.
        params: the agent's parameters.
        known: what it knows at the beginning of every episode, by label.
        starts_seed: the seed of the episode whose starts it keeps; None to draw them anew.
        starts: those starts, x, y and o of each tester's body, where they were recorded.
    """

    words: str
    agent: str
    params: Params
    known: Mapping[str, Memory] = field(default_factory=dict)
    starts_seed: int | None = None
    starts: Sequence[tuple[float, float, float]] | None = None


def of_run(record: Record, params: Params, *, kept: bool, open_loop: bool) -> Subject:
    """The test that was found in an episode.

    Args:
        params: parameters of the agent in place of its own.
        kept: its testers start where they did.
        open_loop: they do what they did, whatever happens, instead of what their agent would do.
    """
    plan, label = record.plan, record.row["agent"]
    if label not in plan.cast:
        raise ResultsError(f"run {record.run} of {record.file}: no agent {label!r} in its manifest")
    words = f"run {record.run} of {record.file} ({label})"
    own = (starts_seed(record), _starts(record)) if kept else (None, None)
    if open_loop:
        if params:
            raise InputError("--open-loop: the recorded actions have no parameters")
        again = f"run{record.run}"
        memory = {again: actions_of(_trace(record), plan)}
        return Subject(f"{words}, open loop", f"{again}=recorded", {}, memory, *own)
    memory = {label: found} if (found := _known_before(record)) is not None else {}
    return Subject(words, _word(plan, label), params_of(plan, label) | params, memory, *own)


def of_policy(
    word: str, plan: BatchPlan, manifest: Mapping[str, Any], file: Path, params: Params
) -> Subject:
    """An agent by the label that it has in results, or one that stands by itself."""
    if word in plan.cast:
        learned = manifest.get("learned", {}).get(word) or (plan.known or {}).get(word)
        memory = {} if learned is None else {word: tuple(learned)}
        after = manifest.get("learned_after", {}).get(word)
        when = "" if after is None or not memory else f", as it knew after run {after}"
        words = f"agent {word} of {file}{when}"
        return Subject(words, _word(plan, word), params_of(plan, word) | params, memory)
    try:
        ((_, name),) = cast_of((word,)).items()
    except ValueError as error:
        raise InputError(f"agent {error}") from error
    if policy_file(name) is None and name not in AGENTS:
        raise UnknownName("run, agent or policy:FILE", word, {*plan.cast, *AGENTS}, str(file))
    return Subject(f"agent {word}", word, params, {})


def settings_of(
    subject: Subject, manifest: Mapping[str, Any], runs: int, seed: int
) -> dict[str, Any]:
    """The settings of a batch that plays a test in the scenario of results; all but the ego.

    Background traffic that is drawn is the scenario's, so it stays what it was.
    """
    settings = {k: v for k, v in recorded_settings(manifest).items() if k not in OTHERS} | {
        "agents": [subject.agent],
        "params": subject.params,
        "known": dict(subject.known),
        "runs": runs,
        "seed": seed,
        "trace": "none",
        "reference": "none",
    }
    if subject.starts_seed is not None:
        settings["starts_seed"] = subject.starts_seed
    if settings.get("traffic") is not None:
        settings.setdefault("traffic_seed", manifest["plan"]["seed"])
    return settings


def starts_seed(record: Record) -> int:
    """The seed from which the starts of an episode were drawn."""
    own = record.plan.scenario.starts_seed
    return int(record.row["seed"]) if own is None else own


def _starts(record: Record) -> list[tuple[float, float, float]] | None:
    """Where the testers of an episode started, if a trace tells."""
    if record.trace is None:
        return None
    return [(x, y, o) for x, y, _, o in record.trace.frames[0]["testers"].values()]


def _word(plan: BatchPlan, label: str) -> str:
    """An agent as its plan names it."""
    return label if plan.cast[label] == label else f"{label}={plan.cast[label]}"


def _known_before(record: Record) -> Memory | None:
    """What an agent knew before an episode: from its trace, or by living through its earlier ones.

    Plain agents know nothing.
    """
    plan, label = record.plan, record.row["agent"]
    if label not in resolve_cast(plan).learners:
        return (plan.known or {}).get(label)
    if record.trace is not None and record.trace.head.get("memory_kept"):
        memory = record.trace.head["memory"]
        return None if memory is None else tuple(memory)
    with Worker(prepared_again(record)) as worker:
        return known(worker, record.run)


def _trace(record: Record) -> Trace:
    """The trace of an episode; it is played again where none was kept."""
    if record.trace is not None:
        return record.trace
    with Worker(prepared_again(record)) as worker:
        again = replayed(worker, record)
    if again.trace is None:
        raise InputError(f"--open-loop: run {record.run} ended in an error: it has no actions")
    return again.trace


def actions_of(trace: Trace, plan: BatchPlan) -> Memory:
    """What each agent of an episode did: for each timestep throttle and steering of its bodies."""
    scenario, bodies = plan.scenario, tester_bodies(plan.scenario)

    def joints(team: Sequence[int]) -> list[list[tuple[float, float]]]:
        return [
            [
                action_between(
                    bodies[i].kind,
                    before["testers"][bodies[i].id],
                    after["testers"][bodies[i].id],
                    scenario.step_length,
                )
                for i in team
            ]
            for before, after in zip(trace.frames, trace.frames[1:], strict=False)
        ]

    return tuple(joints(team) for team in teams(scenario))
