"""Playing back: an episode once more from its record, with any ego and any assertions.

One way for all uses: reruns with a reference driver, replays, certificates (whose plan
holds the record as what its agents know).
"""

from __future__ import annotations

from collections.abc import Sequence

from cavsumo.agents.base import Agent
from cavsumo.agents.recorded import Recorded, RecordedAgent
from cavsumo.model.bodies import Action
from cavsumo.model.departures import Demand
from cavsumo.network.recorded_starts import start_record
from cavsumo.simulation.episode import Episode, Joint
from cavsumo.simulation.loop import EpisodeLoop, played_on
from cavsumo.simulation.setup import Setup


def recorded(setup: Setup, episode: Episode, seed: int, departures: Demand | None) -> Recorded:
    """The record of an episode whose actions were kept, in the setup in which it was played.

    ``departures``: None for the scenario's own demand, also behind the end of the episode.
    """
    return Recorded(
        seed,
        by_body(setup, episode.actions),
        [start_record(setup.site, start) for start in episode.starts],
        [start_record(setup.site, start) for start in episode.waited],
        departures,
        tuple(dict.fromkeys(approach.type for approach in setup.site.approaches)),
    )


def by_body(setup: Setup, joints: Sequence[Joint]) -> list[tuple[Action, ...]]:
    """The actions of all agents in each timestep, in the order of the bodies."""
    owners = sorted(
        (body, agent, i) for agent, team in enumerate(setup.teams) for i, body in enumerate(team)
    )
    places = [(agent, i) for _, agent, i in owners]
    return [tuple([_action(joint[agent][i]) for agent, i in places]) for joint in joints]


def _action(chosen: Sequence[float]) -> Action:
    """A pair that an agent chose."""
    return chosen if isinstance(chosen, Action) else Action(*chosen)


def doing(actions: Sequence[Joint], teams: int) -> list[RecordedAgent]:
    """Agents that do what they are told in each timestep, one for each team, and then nothing."""
    agents = [RecordedAgent() for _ in range(teams)]
    for i, agent in enumerate(agents):
        agent.remember({"starts": (), "waited": (), "actions": [joint[i] for joint in actions]})
    return agents


def playback(
    setup: Setup,
    played: Recorded,
    *,
    record: bool = False,
    alike: Sequence[Agent] = (),
    ends: bool = False,
) -> EpisodeLoop:
    """A recorded episode, about to be played again.

    Args:
        setup: that of the record, but perhaps for the ego and the assertions.
        record: keep every snapshot, and show everybody in it.
        alike: agents that look at as much of the background as those that play; one for each team.
        ends: the testers rest behind the end of the record, so that the episode ends there again.
    """
    agents = played.agents(setup.teams)
    for agent in agents:
        agent.ends = ends
    for agent, other in zip(agents, alike, strict=bool(alike)):
        agent.sees_background = other.sees_background
    return EpisodeLoop(setup, agents, played.seed, record=record, demand=played.departures)


def played_back(setup: Setup, played: Recorded) -> Episode:
    """A recorded episode played again as a whole, every snapshot and action kept."""
    return played_on(playback(setup, played, record=True, ends=True))
