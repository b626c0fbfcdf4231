"""The cast of a batch: which agents play, resolved once from their names and parameters.

Each agent of a plan is built once for its facts; they travel with the batch as one record, from
which the agents are built where they play.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cavsumo.agents.base import AGENTS, Agent
from cavsumo.agents.names import PREFIX, policy_file
from cavsumo.agents.policy import make_agent, parameters_of
from cavsumo.errors import InputError
from cavsumo.model.bodies import Body, kind_named, model_of
from cavsumo.model.names import check_shared
from cavsumo.model.objects import is_here, is_object
from cavsumo.model.plugins import source_file
from cavsumo.model.scenario import BatchPlan, Params, Scenario


@dataclass(frozen=True)
class CastMember:
    """One agent of a batch.

    Attributes:
        label: what the plan and the rows call it.
        name: registered name, ``policy:FILE``, or the name of an object.
        params: its parameters; they and the name have the present paths of files.
        files: what it is made of: the file of a policy or of an object's class, and the files that
            its parameters name, as they were given.
        learns: whether its episodes change what it knows for the next.
        searches: whether a searcher chooses what it plays.
        drives, promise, manoeuvre: as the agent declares them (``Agent``).
    """

    label: str
    name: str
    params: Params
    files: tuple[Path, ...]
    learns: bool
    searches: bool
    drives: bool
    promise: str
    manoeuvre: str

    def make(self) -> Agent:
        """The agent itself, new."""
        return make_agent(self.name, self.params)


@dataclass(frozen=True)
class Cast:
    """The agents of a batch.

    Attributes:
        members: in the order in which they take turns.
        agents_each: how many agents of a member play in an episode, one for each team.
        bodies_each: how many bodies each of them owns.
    """

    members: tuple[CastMember, ...]
    agents_each: int
    bodies_each: int

    def __iter__(self) -> Iterator[CastMember]:
        return iter(self.members)

    def __getitem__(self, label: str) -> CastMember:
        """The member of a label; KeyError for none."""
        for member in self.members:
            if member.label == label:
                return member
        raise KeyError(label)

    @property
    def learners(self) -> frozenset[str]:
        """The labels of the agents that learn from episode to episode."""
        return frozenset(member.label for member in self.members if member.learns)

    @property
    def searchers(self) -> frozenset[str]:
        """The labels of the agents for which a searcher chooses what they play."""
        return frozenset(member.label for member in self.members if member.searches)

    @property
    def files(self) -> list[Path]:
        """The files of all agents."""
        return [file for member in self.members for file in member.files]

    def agents(self, label: str) -> list[Agent]:
        """New agents of one label, one for each team."""
        member = self[label]
        return [member.make() for _ in range(self.agents_each)]

    def check_memory(self, label: str, memory: Sequence[Any] | None, source: str) -> None:
        """Raise InputError unless the agents of a label can have known this before an episode.

        Args:
            memory: the knowledge of each of them; None for none.
            source: names its file.
        """
        agents = [] if memory is None else self.agents(label)
        wrong = InputError(f"{source}: is not what agent {label} can have known")
        if len(agents) != len(memory or ()):
            raise wrong
        for agent, known in zip(agents, memory or (), strict=True):
            try:
                agent.check_memory(known, self.bodies_each)
            except Exception as error:  # also of a user's class, of any sort
                raise wrong from error


def resolve_cast(plan: BatchPlan) -> Cast:
    """Build every agent once and account for every parameter; raises InputError."""
    _check_parameters(plan)
    kind, each = kind_named(plan.scenario.kind), plan.scenario.bodies_per_agent
    members = []
    for label, name in plan.cast.items():
        if label != name and label in AGENTS:
            raise InputError(f"agent {label}={name}: the label is the name of another agent")
        present = _present(plan, label)
        agent = make_agent(*present)
        try:
            agent.check_bodies(kind, each)
        except ValueError as error:
            raise InputError(f"agent {label}: {error}") from error
        members.append(_member(plan, label, agent, *present))
    return Cast(tuple(members), len(teams(plan.scenario)), each)


def _present(plan: BatchPlan, label: str) -> tuple[str, Params]:
    """The name of an agent and its parameters, both with the present paths of files."""
    name, params, scenario = plan.cast[label], params_of(plan, label), plan.scenario
    file = policy_file(name)
    if file is not None:
        return f"{PREFIX}{scenario.present(file)}", params
    files = {key: Path(str(params[key])) for key in _file_keys(name) if key in params}
    present = {key: scenario.present(file) for key, file in files.items()}
    return name, params | {key: str(present[key]) for key in files if present[key] != files[key]}


def _file_keys(name: str) -> tuple[str, ...]:
    """The parameters of a registered agent that name files."""
    return tuple(getattr(AGENTS.get(name), "FILES", ())) if name in AGENTS else ()


def _member(
    plan: BatchPlan, label: str, agent: Agent, present: str, present_params: Params
) -> CastMember:
    """An agent of a plan with the facts that one of it declares."""
    name, params = plan.cast[label], params_of(plan, label)
    own = source_file(name) if is_object(name) else policy_file(name)
    files = [] if own is None else [own]
    return CastMember(
        label,
        present,
        present_params,
        files=(*files, *(Path(str(params[key])) for key in agent.FILES if key in params)),
        learns=agent.learns and plan.known is None,
        searches=agent.searches and plan.known is None,
        drives=agent.drives,
        promise=agent.promise,
        manoeuvre=agent.manoeuvre,
    )


def params_of(plan: BatchPlan, label: str) -> Params:
    """The parameters that a plan gives to one of its agents."""
    return plan.agent_params(label, [p.name for p in parameters_of(plan.cast[label])])


def shown_manoeuvres(plan: BatchPlan) -> set[str]:
    """The manoeuvres that a plan's agents are asked for, without reading files of theirs.

    An episode is shown where a policy's file or one that a parameter names may be missing. It is
    also shown without an agent that was an object of another session.
    """
    return {_shown_manoeuvre(plan, label) for label in plan.cast}


def _shown_manoeuvre(plan: BatchPlan, label: str) -> str:
    """The manoeuvre of an agent of a plan; that of any agent where it cannot be built."""
    name = plan.cast[label]
    if policy_file(name) is not None or (is_object(name) and not is_here(name)):
        return Agent.manoeuvre
    params = params_of(plan, label)
    if not params.keys().isdisjoint(_file_keys(name)):
        return str(getattr(AGENTS.get(name), "manoeuvre", Agent.manoeuvre))
    return make_agent(name, params).manoeuvre


def teams(scenario: Scenario) -> tuple[tuple[int, ...], ...]:
    """For each agent the indices of the bodies that it owns."""
    size = scenario.bodies_per_agent
    return tuple(tuple(range(i, i + size)) for i in range(0, scenario.testers, size))


def tester_bodies(scenario: Scenario) -> tuple[Body, ...]:
    """The testers' bodies, as an agent-body-effector model that was validated (Definition 1)."""
    if scenario.script is not None:
        bodies = scenario.script.bodies
    else:
        kind = kind_named(scenario.kind)
        bodies = tuple(Body(f"tester{i}", kind) for i in range(scenario.testers))
    model_of({f"agent{a}": [bodies[i] for i in team] for a, team in enumerate(teams(scenario))})
    return bodies


def _check_parameters(plan: BatchPlan) -> None:
    """Refuse parameters that no agent of the plan has."""
    known = {label: [p.name for p in parameters_of(name)] for label, name in plan.cast.items()}
    check_shared(plan.params, known, f"agent {' '.join(plan.agents)}")
