"""The checked scenario of an environment, with its site, from the environment's keywords."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cavsumo.batch.prepared import PreparedBatch, prepare
from cavsumo.egos import make_ego
from cavsumo.egos.base import Ego
from cavsumo.envs.commanded import ACTIONS, CommandedEgo
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.bodies import WALKING
from cavsumo.model.checks import choice, whole
from cavsumo.model.scenario import plan_from
from cavsumo.model.scenario.fields import settings as offered
from cavsumo.model.scenario_file import read_config

UNTIL = ("game", "verdict")
REWARDS = ("game", "grade")
PROCESSES = ("this", "own")
KEYS = frozenset(s.key for s in offered() if s.environments)  # keywords of the environments


@dataclass(frozen=True)
class Roles:
    """The roles that the caller controls.

    Attributes:
        agent: the registered agent that plays the testers; None when the caller controls them.
        ego: keywords of the ``CommandedEgo``; None when the scenario's ego drives.
        until: "game": an episode ends when the tester's game does, at its goal or in a dead end;
            "verdict": when the assertions have decided, as in ``cavsumo run``.
        hold: for how many timesteps an action lasts.
        actions: form of the testers' actions: "effectors" or "targets".
        reward: of the testers: "game", or "grade" at the end of an episode and nothing before.
        drawn: whether pictures are made, for which the whole background is read.
    """

    agent: str | None = None
    ego: Mapping[str, Any] | None = None
    until: str = "game"
    hold: int = 1
    actions: str = "effectors"
    reward: str = "game"
    drawn: bool = False
    named: str = field(default="cavsumo", compare=False)  # the name of the environment in messages

    def __post_init__(self) -> None:
        try:
            choice("until", self.until, UNTIL)
            whole("hold", self.hold, 1)
            choice("actions", self.actions, ACTIONS)
            choice("reward", self.reward, REWARDS)
            if self.reward == "grade" and self.until != "verdict":
                raise ValueError("reward 'grade' needs until='verdict'")
        except ValueError as error:
            raise InputError(f"{self.named}: {error}") from error

    def make_ego(self, prepared: PreparedBatch) -> Ego:
        """The ego of the environment."""
        if self.ego is not None:
            return CommandedEgo(**self.ego)
        scenario = prepared.plan.scenario
        return make_ego(scenario.ego, scenario.ego_params)


def prepared_for(
    roles: Roles, config: str | Path | None, given: Mapping[str, Any], *, one_team: bool
) -> PreparedBatch:
    """The prepared scenario of an environment; raises InputError in one sentence.

    Args:
        config: a scenario file, whose batch settings are left aside.
        given: settings by the names of a scenario file; they take precedence over the file's.
        one_team: one agent owns all testers.
    """
    source = roles.named
    for key in given:
        if key not in KEYS:
            raise UnknownName("keyword", key, KEYS | {"config", "hold", "reward", "until"}, source)
    file = read_config(Path(config)) if config is not None else {}
    settings = {k: v for k, v in (file | dict(given)).items() if k in KEYS}
    if settings.get("net") is None:
        raise InputError(f"{source}: no network given; name one with net=FILE")
    settings = {k: v for k, v in settings.items() if v is not None}
    _refuse_what_is_learned(roles, given, settings)
    if one_team:
        _own_all(settings, source)
    plan = plan_from(settings | {"agents": (roles.agent or "noop",)}, source)
    if roles.actions == "targets" and plan.scenario.kind not in WALKING:
        raise InputError(f"{source}: actions 'targets' are for {' and '.join(WALKING)}s only")
    prepared = prepare(plan, CommandedEgo(**roles.ego) if roles.ego is not None else None)
    if prepared.cast.learners:
        raise InputError(
            f"{source}: agent {roles.agent} learns from episode to episode, so a seed would not "
            "make an episode; params={'learn': False} plays what was learned"
        )
    return prepared


def _refuse_what_is_learned(
    roles: Roles, given: Mapping[str, Any], settings: dict[str, Any]
) -> None:
    """Refuse settings of the role that the learner replaces; a scenario file may have them."""
    replaced = ["ego", "ego_params"] if roles.ego is not None else []
    replaced += ["params"] if roles.agent is None else []
    for key in replaced:
        if given.get(key):
            who = "ego is" if key.startswith("ego") else "testers are"
            raise InputError(f"{roles.named}: {key}: the {who} moved by the caller of step")
        settings.pop(key, None)


def _own_all(settings: dict[str, Any], source: str) -> None:
    """One agent for all testers; refuse another number of bodies per agent."""
    testers = settings.get("testers", 3)
    if settings.setdefault("bodies_per_agent", testers) != testers:
        raise InputError(
            f"{source}: bodies_per_agent {settings['bodies_per_agent']}: here one learner owns all "
            f"{testers} testers; cavsumo.envs.parallel_env has an agent for each team"
        )
