"""Algorithm 1 of the seed: agents, ego and world, one timestep after another.

The testers' states are integrated here by the kinematics and sent to the world.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from cavsumo.agents.base import Agent, Forecast
from cavsumo.assertions.base import HELD, INVALID, UNFAIR, VIOLATED, Judgement, weightiest
from cavsumo.assertions.blame import blamed
from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.validity import ValidityMonitor
from cavsumo.egos.base import Drive, Ego
from cavsumo.model.bodies import Action
from cavsumo.model.departures import Demand
from cavsumo.model.left_behind import LeftBehind
from cavsumo.model.snapshot import Snapshot
from cavsumo.simulation.courses import course_of
from cavsumo.simulation.ego_progress import ego_progress
from cavsumo.simulation.ending import all_behind, at_end, over
from cavsumo.simulation.episode import Episode, Joint
from cavsumo.simulation.foresight import human_short
from cavsumo.simulation.moving import moved
from cavsumo.simulation.rewards import Feedback, RewardMonitor
from cavsumo.simulation.setup import Setup
from cavsumo.simulation.starting import cast, generators_of, started


class EpisodeLoop:
    """One running episode (Algorithm 1).

    Args:
        agents: one for each team, kept from episode to episode, so that learners learn.
        seed: of the episode; every random number in it comes from here.
        record: keep every snapshot, and show everybody in it.
        keep: keep every snapshot as it is, and what the agents chose, to play it again.
        demand: departures of the background that were recorded, in place of the scenario's demand.

    Attributes:
        setup: with which it is played.
        scene: the constant part of the episode.
        placed: where the testers started.
        snapshot: the true state now.
        history: all states so far.
        ego_view, agent_views: the views of the ego and of each agent.
        over: whether it has ended.
        measured: whether rewards, validity, naturalness and criticality are found from here on;
            a rerun, which is played for its verdict alone, needs none of them.
    """

    def __init__(
        self,
        setup: Setup,
        agents: Sequence[Agent],
        seed: int,
        *,
        record: bool = False,
        keep: bool = False,
        demand: Demand | None = None,
    ) -> None:
        self.setup, self._agents = setup, agents
        self.scene, self._senses, begun, self._generators = started(
            setup, agents, seed, record, demand
        )
        self.placed, self.snapshot = begun, begun.snapshot
        self._place = setup.world.begun
        self._show(self.snapshot)
        self._rewards = RewardMonitor(self.scene, setup.teams)
        self._episode = Episode(Judgement(""), starts=begun.starts, waited=begun.waited)
        self._episode.forecast = _foretold(agents, self.agent_views)
        self._validity = ValidityMonitor(self.scene)
        self._behind = LeftBehind(self.scene)
        self.history: list[Snapshot] = self._episode.seen  # for blame, progress and grade
        self._chosen: list[Joint] = []
        self._keep(record or keep)
        self._arrived, self._cut, self.measured = False, False, True
        self._learners = _learn(agents)
        self._observe(self.snapshot)
        self._end(over(setup, self.snapshot))

    def step(self) -> Feedback | None:
        """One timestep: all choose, the world moves on; returns the agents' rewards.

        None once their game is over, although the episode may continue until all assertions decide.
        """
        setup, episode, snapshot, agents = self.setup, self._episode, self.snapshot, self._agents
        scene, views = self.scene, self.agent_views
        actions = [a.choose_action(view) for a, view in zip(agents, views, strict=True)]
        states = moved(snapshot.testers, setup.teams, actions, scene.dt)
        command = setup.ego.act(self.ego_view)
        episode.drives = isinstance(command, Drive)
        self._chosen.append(actions)
        successor = setup.world.step(states, command)
        if successor is None or (episode.drives and at_end(scene, successor)):
            self._arrived = True
            self._end(True)
            rewards = self._rewards.lost()
            _feed_back(agents, views, actions, rewards, views)
            return rewards
        braking = (snapshot.ego.v - successor.ego.v) / scene.dt
        if braking > episode.max_decel:
            episode.max_decel = braking
        self._observe(successor)
        rewards = self._rewarded(successor) if self.measured else None
        self._show(successor)
        if self._learners:
            _feed_back(agents, views, actions, rewards, self.agent_views)
        self.snapshot = successor
        ended = over(setup, successor) or any(agent.stops() for agent in agents)
        self._cut = not (ended or episode.drives) and all_behind(
            setup, agents, self._behind, successor
        )
        self._end(ended or self._cut)
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
        episode.notes = self._agents[0].notes() if self._agents else ""
        spoilt = self._validity.spoils(episode.judgement)
        late = self.snapshot.time >= self.setup.scenario.end - 1e-9
        arrived = True if self._arrived else False if late else None
        episode.progress = ego_progress(self.scene, self.history, arrived, cut=self._cut)
        episode.invalid, episode.breach = spoilt is not None, spoilt or self._validity.first
        episode.course = course_of(self.scene, self.history, episode.judgement.tester)
        if episode.outcome == VIOLATED:
            episode.blame = blamed(self.scene, self.history, episode.judgement)
        elif self.measured and episode.outcome in (HELD, UNFAIR):
            episode.short = human_short(self.scene, self.history, episode.judgement)
        return episode

    def _rewarded(self, successor: Snapshot) -> Feedback | None:
        """The agents' rewards for a timestep."""
        judgements = [a.judgement for a in self.setup.assertions]
        return self._rewards.rewards(successor, judgements, self._validity.breaches)

    def _observe(self, snapshot: Snapshot) -> None:
        """Show a snapshot to the monitors and the assertions.

        The testers are checked until an assertion is violated: later breaches change no verdict.
        """
        episode, assertions = self._episode, self.setup.assertions
        contacts = episode.contacts.observe(snapshot)
        if self.measured:
            if VIOLATED not in [a.judgement.verdict for a in assertions]:
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
) -> Episode:
    """A whole episode; the arguments are those of ``EpisodeLoop``."""
    return played_on(EpisodeLoop(setup, agents, seed, record=record, keep=keep))


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
