"""Algorithm 1 of the seed: agents, ego and world, one timestep after another.

The truth about the testers' bodies is integrated here by the kinematics; the world is told.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from cavsumo.agents.base import Agent, Forecast
from cavsumo.assertions.base import INVALID, VIOLATED, Assertion, Judgement, weightiest
from cavsumo.assertions.blame import blamed
from cavsumo.assertions.contacts import ContactMonitor
from cavsumo.assertions.criticality_monitor import CriticalityMonitor, Extremes
from cavsumo.assertions.naturalness import Naturalness
from cavsumo.assertions.validity import Breach, ValidityMonitor
from cavsumo.egos.base import Drive, Ego
from cavsumo.errors import AgentError
from cavsumo.model.bodies import Action, Kind
from cavsumo.model.carriageway import Start
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scenario import Simulation
from cavsumo.model.scene import Scene
from cavsumo.model.seeds import starts_generator
from cavsumo.model.sensors import Senses
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.simulation.ego_progress import EgoProgress, ego_progress
from cavsumo.simulation.rewards import Feedback, RewardMonitor
from cavsumo.simulation.setup import Setup

# An episode whose verdict is open at the horizon may run on for this long [s].
OVERTIME_S = 15.0


# What all agents chose at one timestep: for each its bodies' actions.
Joint = Sequence[Sequence[Action]]


@dataclass
class Episode:
    """What happened, while and after it happens.

    Frames and actions only where they are kept; ``drives``: whether the ego steers itself;
    ``forecast``: what the testers said of it beforehand.
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
    frames: list[Snapshot] = field(default_factory=list)
    actions: list[Joint] = field(default_factory=list)
    drives: bool = False
    forecast: Forecast | None = None

    @property
    def outcome(self) -> str:
        """What came out: the verdict, unless a tester broke the rules of the world before it."""
        return INVALID if self.invalid else self.judgement.verdict


class EpisodeLoop:
    """One episode under way (Algorithm 1).

    Args:
        agents: one for each team, kept from episode to episode, so that learners learn.
        seed: of the episode; every random number in it comes from here.
        record: keep every snapshot, and show everybody in it.
        keep: keep every snapshot as it is, and what the agents chose, to play it again.
        simulation: whose it is played in (``World.reset``).

    Attributes:
        scene: what does not change during the episode.
        snapshot: the truth now.
        ego_view, agent_views: what the ego and each agent see of it.
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
    ) -> None:
        self._setup, self._agents, self._record = setup, agents, record or keep
        self.scene, self.snapshot, self._senses = _reset(setup, agents, seed, record, simulation)
        self._show(self.snapshot)
        self._rewards = RewardMonitor(self.scene, setup.teams)
        self._episode = Episode(Judgement(""))
        self._episode.forecast = _foretold(agents, self.agent_views)
        self._validity = ValidityMonitor(self.scene)
        self._history: list[Snapshot] = []  # what blame and progress are found from
        self._arrived = False
        self._learners = any(type(a).process_feedback is not Agent.process_feedback for a in agents)
        self._observe(self.snapshot)
        self._end(_over(setup, self.snapshot))

    def step(self) -> Feedback | None:
        """One timestep: everybody chooses, the world moves on; what the agents earned by it.

        None once their game is over, although the episode may go on until all is decided.
        """
        setup, episode, snapshot, agents = self._setup, self._episode, self.snapshot, self._agents
        scene, views = self.scene, self.agent_views
        actions = [a.choose_action(view) for a, view in zip(agents, views, strict=True)]
        states = _moved(snapshot.testers, setup.teams, actions, scene.dt)
        command = setup.ego.act(self.ego_view)
        episode.drives = isinstance(command, Drive)
        if self._record:
            episode.actions.append(actions)
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

    @property
    def contacts(self) -> ContactMonitor:
        """Who touched whom so far."""
        return self._episode.contacts

    @property
    def judgement(self) -> Judgement:
        """The most serious of what the assertions say so far."""
        return weightiest(self._setup.assertions)

    @property
    def outcome(self) -> str:
        """What came out so far."""
        return INVALID if self._validity.spoils(self.judgement) else self.judgement.verdict

    def finished(self) -> Episode:
        """What happened, or what happened so far."""
        episode = _finished(self._setup, self._episode, self.snapshot, self._rewards)
        episode.rms_acceleration = episode.naturalness.rms_acceleration(
            episode.steps, self.scene.dt
        )
        spoilt = self._validity.spoils(episode.judgement)
        late = self.snapshot.time >= self._setup.scenario.end - 1e-9
        arrived = True if self._arrived else False if late else None
        episode.progress = ego_progress(self.scene, self._history, arrived)
        episode.invalid, episode.breach = spoilt is not None, spoilt or self._validity.first
        if episode.outcome == VIOLATED:
            episode.blame = blamed(self.scene, self._history, episode.judgement)
        return episode

    def _observe(self, snapshot: Snapshot) -> None:
        """Show a snapshot to the monitors and the assertions.

        The testers are watched until an assertion is violated: what follows changes no verdict.
        """
        episode, assertions = self._episode, self._setup.assertions
        contacts = episode.contacts.observe(snapshot)
        if not any(a.judgement.verdict == VIOLATED for a in assertions):
            self._validity.observe(snapshot, episode.contacts.pairs)
        episode.naturalness.observe(snapshot)
        episode.criticality.observe(snapshot, contacts)
        for assertion in assertions:
            assertion.observe(snapshot, contacts)
        self._history.append(snapshot)
        if self._record:
            episode.frames.append(snapshot)

    def _end(self, over: bool) -> None:
        """Note whether the episode is over; if so, the ego and the assertions are told."""
        self.over = over
        if over:
            self._setup.ego.conclude()
            for assertion in self._setup.assertions:
                assertion.conclude()

    def _show(self, snapshot: Snapshot) -> None:
        """Let everybody see a snapshot: all of it, unless there are sensors."""
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
    loop = EpisodeLoop(setup, agents, seed, record=record, keep=keep, simulation=simulation)
    while not loop.over:
        loop.step()
    return loop.finished()


def _reset(
    setup: Setup, agents: Sequence[Agent], seed: int, record: bool, simulation: Simulation
) -> tuple[Scene, Snapshot, Senses | None]:
    """Draw the starts and begin an episode; one generator for each who draws."""
    streams = np.random.SeedSequence(seed)
    _, electing, *rest = map(np.random.default_rng, streams.spawn(2 + len(agents)))
    scenario = setup.scenario
    placing = starts_generator(seed if scenario.starts_seed is None else scenario.starts_seed)
    kinds = [body.kind for body in setup.bodies]
    ego = setup.world.ego_body
    starts = setup.site.draw(kinds, ego.kind, scenario.start_speed, placing)
    watching: list[Ego | Agent | Assertion] = [setup.ego, *agents, *setup.assertions]
    # Vehicles keep their distance to whoever is ahead of them, so they see everybody.
    driving = any(start.approach for start in starts)
    everything = record or driving or bool(scenario.ego_sensor or scenario.tester_sensor)
    everything = everything or any(who.sees_background for who in watching)
    snapshot = setup.world.reset(
        seed, _states(setup, starts), starts, everything=everything, simulation=simulation
    )
    starts, snapshot = _cleared(setup, starts, snapshot, placing)
    scene = setup.site.scene(setup.world.dt, ego, setup.bodies, starts, seed)
    scene = dataclasses.replace(scene, horizon=scenario.end)
    senses = _senses(setup, scene, streams)
    for agent, team, rng in zip(agents, setup.teams, rest, strict=True):
        agent.reset(scene, team, rng)
    type(agents[0]).coordinate(agents, electing)
    setup.ego.reset(scene)
    for assertion in setup.assertions:
        assertion.reset(scene)
    return scene, snapshot, senses


def _cleared(
    setup: Setup, starts: tuple[Start, ...], snapshot: Snapshot, rng: np.random.Generator
) -> tuple[tuple[Start, ...], Snapshot]:
    """Starts and first snapshot without testers on foot where others are as the ego enters.

    Traffic is there before the testers are drawn, and where it stands depends on the episode.
    """
    kinds = [body.kind for body in setup.bodies]
    near = [snapshot.ego.box, *(other.box for other in snapshot.background)]
    if not setup.site.blocked(kinds, starts, near):
        return starts, snapshot
    taken = [snapshot.ego.box, *(BodyState(*raw).box for raw in setup.world.everybody())]
    starts = setup.site.cleared(kinds, starts, taken, rng)
    return starts, setup.world.shift(tuple(_states(setup, starts)))


def _foretold(agents: Sequence[Agent], views: Sequence[Snapshot]) -> Forecast | None:
    """What the agents say of the episode before it: the best that one of them says."""
    said = [agent.forecast(view) for agent, view in zip(agents, views, strict=True)]
    return max((one for one in said if one is not None), default=None, key=Forecast.rank)


def _senses(setup: Setup, scene: Scene, streams: np.random.SeedSequence) -> Senses | None:
    """The observers of an episode, None with full observability.

    Their generators come after all others, which are the same with sensors and without.
    """
    ego, testers = setup.scenario.ego_sensor, setup.scenario.tester_sensor
    if not (ego or testers):
        return None
    seeds = streams.spawn(1 + len(setup.teams))
    return Senses(scene, ego, testers, setup.teams, seeds)


def _states(setup: Setup, starts: Sequence[Start]) -> list[BodyState]:
    """The testers' first states."""

    wanted = setup.scenario.start_speed

    def speed(kind: Kind, start: Start) -> float:
        if start.v is not None:
            return start.v
        return kind.v_max if wanted is None else min(kind.v_max, wanted)

    return [
        BodyState(body, start.x, start.y, speed(body.kind, start), start.o)
        for body, start in zip(setup.bodies, starts, strict=True)
    ]


def _moved(
    testers: tuple[BodyState, ...],
    teams: Sequence[Sequence[int]],
    actions: Sequence[Sequence[Action]],
    dt: float,
) -> tuple[BodyState, ...]:
    """The testers' next states by the kinematics (seed, eqs 8 to 19).

    A body that stands keeps its very record, and if all do, so does their tuple: by that others
    know, without a look at the numbers, that nothing has changed.
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
    """Whether a freely driving ego has come to the end of its path."""
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
    assert math.isfinite(episode.reward)
    return episode
