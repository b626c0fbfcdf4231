"""Algorithm 1 of the seed: agents, ego and world, one timestep after another.

The testers' states are integrated here by the kinematics and sent to the world.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from cavsumo.agents.base import Agent, Forecast
from cavsumo.assertions.base import INVALID, VIOLATED, Judgement, weightiest
from cavsumo.assertions.blame import blamed
from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.criticality_monitor import CriticalityMonitor, Extremes
from cavsumo.assertions.naturalness import Naturalness
from cavsumo.assertions.validity import Breach, ValidityMonitor
from cavsumo.egos.base import Drive, Ego
from cavsumo.errors import AgentError
from cavsumo.model.bodies import Action
from cavsumo.model.carriageway import Start
from cavsumo.model.departures import Demand
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scenario import Simulation
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.simulation.ego_progress import EgoProgress, ego_progress
from cavsumo.simulation.rewards import Feedback, RewardMonitor
from cavsumo.simulation.setup import Setup
from cavsumo.simulation.starting import cast, generators_of, started

# An episode whose verdict is open at the horizon may run on for this long [s].
OVERTIME_S = 15.0


# The actions of all agents at one timestep: for each agent those of its bodies.
Joint = Sequence[Sequence[Action]]


@dataclass
class Episode:
    """The record of an episode, during and after it.

    ``seen``: all snapshots; frames and actions only where they are kept; ``drives``: whether the
    ego steers itself; ``forecast``: what the testers said of it beforehand; ``starts``: where they
    started, and ``waited``: where they were while the ego entered; ``departures``: of the
    background, None where they were not recorded or do not tell all of it.
    """

    judgement: Judgement
    verdicts: Mapping[str, str] = field(default_factory=dict)
    steps: int = 0
    time: float = 0.0
    max_decel: float = 0.0
    contacts: ContactMonitor = field(default_factory=ContactMonitor)
    naturalness: Naturalness = field(default_factory=Naturalness)
    breach: Breach | None = None
    invalid: bool = False
    blame: str = ""
    rms_acceleration: float = 0.0
    criticality: CriticalityMonitor = field(default_factory=CriticalityMonitor)
    extremes: Extremes = field(default_factory=Extremes)
    progress: EgoProgress = field(default_factory=EgoProgress)
    cost: float = 0.0
    reward: float = 0.0
    sumo_collisions: frozenset[tuple[str, str]] = frozenset()
    teleports: int = 0
    emergency_stops: int = 0
    seen: list[Snapshot] = field(default_factory=list)
    frames: list[Snapshot] = field(default_factory=list)
    actions: list[Joint] = field(default_factory=list)
    starts: tuple[Start, ...] = ()
    waited: tuple[Start, ...] = ()
    departures: Demand | None = None
    drives: bool = False
    forecast: Forecast | None = None

    @property
    def outcome(self) -> str:
        """The outcome: the verdict, unless a tester broke the rules of the world before it."""
        return INVALID if self.invalid else self.judgement.verdict


class EpisodeLoop:
    """One running episode (Algorithm 1).

    Args:
        agents: one for each team, kept from episode to episode, so that learners learn.
        seed: of the episode; every random number in it comes from here.
        record: keep every snapshot, and show everybody in it.
        keep: keep every snapshot as it is, and what the agents chose, to play it again.
        simulation: whose it is played in (``World.reset``).
        demand: departures of the background that were recorded, in place of the scenario's demand.

    Attributes:
        setup: with which it is played.
        scene: the constant part of the episode.
        placed: where the testers started.
        snapshot: the true state now.
        history: all states so far.
        ego_view, agent_views: the views of the ego and of each agent.
        over: whether it has ended.
    """

    def __init__(
        self,
        setup: Setup,
        agents: Sequence[Agent],
        seed: int,
        *,
        record: bool = False,
        keep: bool = False,
        simulation: Simulation = "own",
        demand: Demand | None = None,
    ) -> None:
        self.setup, self._agents = setup, agents
        self.scene, self._senses, begun, self._generators = started(
            setup, agents, seed, record, simulation, demand
        )
        self.placed, self.snapshot = begun, begun.snapshot
        self._place = setup.world.begun
        self._show(self.snapshot)
        self._rewards = RewardMonitor(self.scene, setup.teams)
        self._episode = Episode(Judgement(""), starts=begun.starts, waited=begun.waited)
        self._episode.forecast = _foretold(agents, self.agent_views)
        self._validity = ValidityMonitor(self.scene)
        self.history: list[Snapshot] = self._episode.seen  # for blame, progress and grade
        self._chosen: list[Joint] = []
        self._keep(record or keep)
        self._arrived = False
        self._learners = _learn(agents)
        self._observe(self.snapshot)
        self._end(_over(setup, self.snapshot))

    def step(self) -> Feedback | None:
        """One timestep: all choose, the world moves on; returns the agents' rewards.

        None once their game is over, although the episode may continue until all assertions decide.
        """
        setup, episode, snapshot, agents = self.setup, self._episode, self.snapshot, self._agents
        scene, views = self.scene, self.agent_views
        actions = [a.choose_action(view) for a, view in zip(agents, views, strict=True)]
        states = _moved(snapshot.testers, setup.teams, actions, scene.dt)
        command = setup.ego.act(self.ego_view)
        episode.drives = isinstance(command, Drive)
        self._chosen.append(actions)
        successor = setup.world.step(states, command)
        if successor is None or (episode.drives and _at_end(scene, successor)):
            self._arrived = True
            self._end(True)
            rewards = self._rewards.lost()
            _feed_back(agents, views, actions, rewards, views)
            return rewards
        braking = (snapshot.ego.v - successor.ego.v) / scene.dt
        if braking > episode.max_decel:
            episode.max_decel = braking
        self._observe(successor)
        judgements = [a.judgement for a in setup.assertions]
        rewards = self._rewards.rewards(successor, judgements, self._validity.breaches)
        self._show(successor)
        if self._learners:
            _feed_back(agents, views, actions, rewards, self.agent_views)
        self.snapshot = successor
        self._end(_over(setup, successor))
        return rewards

    def hand_over(
        self,
        agents: Sequence[Agent] | None = None,
        ego: Ego | None = None,
        seed: int | None = None,
        *,
        record: bool = False,
    ) -> None:
        """Let others choose from this timestep on: the episode becomes another one.

        Args:
            agents: in place of those so far, who else continue; one for each team.
            ego: likewise; its box is that of the ego that it replaces.
            seed: of all random numbers from now on, SUMO's too; None for those that would have
                followed.
            record: keep every snapshot and action, and show everybody from now on.
        """
        setup, scene = self.setup, self.scene
        everybody = record or any(who.sees_background for who in (ego, *(agents or ())) if who)
        fresh = self._generators if seed is None else generators_of(setup, seed)
        for own, other in zip(self._generators, fresh, strict=True):
            own.bit_generator.state = other.bit_generator.state
        if seed is not None:
            setup.world.reseed(seed)
            scene = dataclasses.replace(scene, seed=seed)
        if agents is not None:
            self._agents, self._learners = agents, _learn(agents)
            cast(setup, agents, scene, self._generators)
        if ego is not None:
            ego.prepare(setup.mission)
            ego.reset(scene)
            self.setup = dataclasses.replace(setup, ego=ego)
        if everybody:
            self.snapshot = setup.world.show_everybody()
            self._show(self.snapshot)
        self._keep(record)

    @property
    def replaced(self) -> bool:
        """Whether another episode has begun in its simulation, so that it cannot continue."""
        return self.setup.world.begun != self._place

    @property
    def contacts(self) -> ContactMonitor:
        """The contacts so far."""
        return self._episode.contacts

    @property
    def judgement(self) -> Judgement:
        """The most serious judgement of the assertions so far."""
        return weightiest(self.setup.assertions)

    @property
    def outcome(self) -> str:
        """The outcome so far."""
        return INVALID if self._validity.spoils(self.judgement) else self.judgement.verdict

    def finished(self) -> Episode:
        """The record of the episode, possibly so far."""
        episode = _finished(self.setup, self._episode, self.snapshot, self._rewards)
        episode.rms_acceleration = episode.naturalness.rms_acceleration(
            episode.steps, self.scene.dt
        )
        spoilt = self._validity.spoils(episode.judgement)
        late = self.snapshot.time >= self.setup.scenario.end - 1e-9
        arrived = True if self._arrived else False if late else None
        episode.progress = ego_progress(self.scene, self.history, arrived)
        episode.invalid, episode.breach = spoilt is not None, spoilt or self._validity.first
        if episode.outcome == VIOLATED:
            episode.blame = blamed(self.scene, self.history, episode.judgement)
        return episode

    def _observe(self, snapshot: Snapshot) -> None:
        """Show a snapshot to the monitors and the assertions.

        The testers are checked until an assertion is violated: later breaches change no verdict.
        """
        episode, assertions = self._episode, self.setup.assertions
        contacts = episode.contacts.observe(snapshot)
        if not any(a.judgement.verdict == VIOLATED for a in assertions):
            self._validity.observe(snapshot, episode.contacts.pairs)
        episode.naturalness.observe(snapshot)
        episode.criticality.observe(snapshot, contacts)
        for assertion in assertions:
            assertion.observe(snapshot, contacts)
        self.history.append(snapshot)

    def _keep(self, kept: bool) -> None:
        """Whether snapshots and actions, of all timesteps, are in the record of the episode."""
        self._episode.frames = self.history if kept else []
        self._episode.actions = self._chosen if kept else []

    def _end(self, over: bool) -> None:
        """Note whether the episode is over; if so, the ego and the assertions are told."""
        self.over = over
        if over:
            self.setup.ego.conclude()
            for assertion in self.setup.assertions:
                assertion.conclude()

    def _show(self, snapshot: Snapshot) -> None:
        """Make the views of a snapshot: the whole snapshot, unless there are sensors."""
        if self._senses is None:
            self.ego_view, self.agent_views = snapshot, (snapshot,) * len(self._agents)
        else:
            self.ego_view, self.agent_views = self._senses.views(snapshot)


def play(
    setup: Setup,
    agents: Sequence[Agent],
    seed: int,
    *,
    record: bool = False,
    keep: bool = False,
    simulation: Simulation = "own",
) -> Episode:
    """A whole episode; the arguments are those of ``EpisodeLoop``."""
    return played_on(
        EpisodeLoop(setup, agents, seed, record=record, keep=keep, simulation=simulation)
    )


def played_on(loop: EpisodeLoop) -> Episode:
    """An episode played to its end."""
    while not loop.over:
        loop.step()
    return loop.finished()


def _learn(agents: Sequence[Agent]) -> bool:
    """Whether any agent learns from feedback."""
    return any(type(a).process_feedback is not Agent.process_feedback for a in agents)


def _foretold(agents: Sequence[Agent], views: Sequence[Snapshot]) -> Forecast | None:
    """The agents' forecast of the episode: the best of theirs."""
    said = [agent.forecast(view) for agent, view in zip(agents, views, strict=True)]
    return max((one for one in said if one is not None), default=None, key=Forecast.rank)


def _moved(
    testers: tuple[BodyState, ...],
    teams: Sequence[Sequence[int]],
    actions: Sequence[Sequence[Action]],
    dt: float,
) -> tuple[BodyState, ...]:
    """The testers' next states by the kinematics (seed, eqs 8 to 19).

    A body that stands keeps the same record object, and if all do, so does their tuple: identity
    then tells, without comparing numbers, that nothing has changed.
    """
    moved: list[BodyState] = []
    for team, joint in zip(teams, actions, strict=True):
        if len(joint) != len(team):
            raise AgentError(f"an agent with {len(team)} bodies chose {len(joint)} actions")
        for i, (throttle, steering) in zip(team, joint, strict=True):
            state = testers[i]
            body, x, y, v, o = state
            kind = body.kind
            if not (
                kind.throttle_min - 1e-9 <= throttle <= kind.throttle_max + 1e-9
                and abs(steering) <= kind.steering_max + 1e-9
            ):
                raise AgentError(f"{body.id}: no such action: {throttle=}, {steering=}")
            if v == 0.0 and throttle <= 0.0 and kind.v_min == 0.0:
                continue
            moved = moved or list(testers)
            moved[i] = BodyState(
                body,
                *step_floats(
                    x, y, v, o, throttle, steering, kind.wheelbase, kind.v_min, kind.v_max, dt
                ),
            )
    return tuple(moved) if moved else testers


def _feed_back(
    agents: Sequence[Agent],
    before: Sequence[Snapshot],
    actions: Sequence[tuple[Action, ...]],
    rewards: Feedback | None,
    after: Sequence[Snapshot],
) -> None:
    """ProcessFeedback for every agent, until the game is over."""
    if rewards is None:
        return
    for agent, snapshot, action, reward, successor in zip(
        agents, before, actions, rewards[0], after, strict=True
    ):
        agent.process_feedback(snapshot, action, reward, successor, rewards[1])


def _over(setup: Setup, snapshot: Snapshot) -> bool:
    """The terminator psi: every assertion decided, or the horizon with none pending."""
    for assertion in setup.assertions:
        if not assertion.decided:
            break
    else:
        return True
    left = setup.scenario.end - snapshot.time
    if left > 1e-9:
        return False
    return left < -OVERTIME_S or not any(a.pending for a in setup.assertions)


def _at_end(scene: Scene, snapshot: Snapshot) -> bool:
    """Whether a freely driving ego has reached the end of its path."""
    ego, path = snapshot.ego, scene.ego_path
    return path.project(ego.x, ego.y).along >= path.length - ego.body.kind.length / 2


def _finished(
    setup: Setup, episode: Episode, snapshot: Snapshot, rewards: RewardMonitor
) -> Episode:
    """The episode with its totals."""
    episode.judgement = weightiest(setup.assertions)
    episode.verdicts = {a.name: a.judgement.verdict for a in setup.assertions}
    episode.steps, episode.time = snapshot.step, snapshot.time
    episode.extremes = episode.criticality.extremes()
    episode.cost, episode.reward = rewards.cost, rewards.total
    world = setup.world
    episode.sumo_collisions = frozenset(world.collisions)
    episode.teleports, episode.emergency_stops = world.teleports, world.emergency_stops
    episode.departures = world.departures
    assert math.isfinite(episode.reward)
    return episode
