"""Definition 1 of the seed: agents own bodies, bodies own effectors, effectors have actions.

Kinds of body carry CAV-Gym's constants (github.com/TSL-UOB/CAV-Gym, examples/constants.py, there
in pixels of 1/16 m), here in metres, seconds and radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.geometry import wrap

if TYPE_CHECKING:
    from gymnasium import spaces

THROTTLE, STEERING = "throttle", "steering"


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of body: its box and the limits of its kinematics.

    Attributes:
        name: the kind's name.
        length, width: size of the box [m].
        wheelbase: distance between the axles, the seed's b [m].
        v_min, v_max: speed limits [m/s].
        throttle_min, throttle_max: limits of the throttle, an acceleration [m/s2].
        steering_max: largest steering angle to either side [rad].
        reach: largest distance of a point of the box from its centre [m].
        inner: smallest distance of a point of its outline from its centre [m].
        turning: sin(beta) at full steering, which limits its turns (see ``kinematics``).
    """

    name: str
    length: float
    width: float
    wheelbase: float
    v_min: float
    v_max: float
    throttle_min: float
    throttle_max: float
    steering_max: float
    reach: float = field(init=False)
    inner: float = field(init=False)
    turning: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "reach", math.hypot(self.length, self.width) / 2)
        object.__setattr__(self, "inner", min(self.length, self.width) / 2)
        turning = math.sin(math.atan(0.5 * math.tan(self.steering_max)))
        object.__setattr__(self, "turning", turning)


def turn_radius(kind: Kind) -> float:
    """Radius of the circle on which a body turns at full steering, b / (2 sin beta) [m]."""
    return kind.wheelbase / (2.0 * kind.turning)


def detour(kind: Kind, o: float, heading: float) -> float:
    """Extra length of a way due to turning from o to its heading first, at full steering [m].

    A body turning by phi on the radius R = b / (2 sin beta) goes R phi and gains R sin phi.
    """
    if heading == o:
        return 0.0
    phi = abs(wrap(heading - o))
    return turn_radius(kind) * (phi - math.sin(phi))


PEDESTRIAN = Kind(
    "pedestrian", 0.65625, 0.875, 0.328125, 0.0, 1.4, -1.4, 1.4, steering_max=0.4 * math.pi
)
CAR = Kind("car", 4.5, 1.75, 3.0, 0.0, 9.0, -9.0, 9.0, steering_max=0.2 * math.pi)
# CAV-Gym's bus has a wheelbase longer than the bus; it is kept, so that runs can be compared.
BUS = Kind("bus", 12.0, 2.55, 16.875, 0.0, 6.75, -6.75, 6.75, steering_max=0.16 * math.pi)
# CAV-Gym allows a bicycle pi/2; the seed wants the open interval, so the next float below it.
BICYCLE = Kind(
    "bicycle", 2.25, 0.875, 2.025, 0.0, 4.5, -4.5, 4.5, steering_max=math.nextafter(math.pi / 2, 0)
)
KINDS: Mapping[str, Kind] = {k.name: k for k in (PEDESTRIAN, CAR, BUS, BICYCLE)}
WALKING = (PEDESTRIAN.name,)  # kinds that start on pavements; the others start on lanes for cars
SIDEWAYS_MPS2 = 5.0  # largest acceleration sideways of one that drives: half of what tyres hold


def kind_named(name: str) -> Kind:
    """The kind of that name; raises UnknownName with the nearest one."""
    if name not in KINDS:
        raise UnknownName("kind of body", name, KINDS)
    return KINDS[name]


class Body(NamedTuple):
    """One body of the simulation: its id and its kind."""

    id: str
    kind: Kind


class Action(NamedTuple):
    """The actions of a body's two effectors for one timestep."""

    throttle: float  # m/s2
    steering: float  # rad, positive to the left


NOOP = Action(0.0, 0.0)


def clamped(action: Action, kind: Kind) -> Action:
    """The action nearest to the given one that the kind's effectors can execute."""
    throttle, steering = action
    return Action(
        min(kind.throttle_max, max(kind.throttle_min, throttle)),
        min(kind.steering_max, max(-kind.steering_max, steering)),
    )


def effector(body: str, name: str) -> str:
    """The id of a body's effector."""
    return f"{body}.{name}"


@dataclass(frozen=True)
class AgentBodyEffectorModel:
    """(N, B, E, f_BN, f_EB) with the actions A(e) of each effector (Definition 1).

    Attributes:
        agents: N.
        body_agent: f_BN, from each body to its agent.
        effector_body: f_EB, from each effector to its body.
        actions: A(e) as an interval (low, high), low <= high, for each effector.

    Raises InputError when a map is no surjection or an action set is empty. Corollary 1,
    |N| <= |B| <= |E|, follows from the two surjections.
    """

    agents: tuple[str, ...]
    body_agent: Mapping[str, str]
    effector_body: Mapping[str, str]
    actions: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        _once("agent", self.agents)
        _surjection("bodies", self.body_agent, "agents", self.agents)
        _surjection("effectors", self.effector_body, "bodies", self.body_agent)
        for e in self.effector_body:
            low, high = self.actions.get(e, (math.nan, math.nan))
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise InputError(f"effector {e!r} has no actions: [{low}, {high}] is empty")

    def bodies(self, agents: Iterable[str]) -> tuple[str, ...]:
        """B(N'): the bodies of some agents."""
        return _inverse_image(self.body_agent, self.agents, agents, "agent")

    def effectors(self, bodies: Iterable[str]) -> tuple[str, ...]:
        """E(B'): the effectors of some bodies."""
        return _inverse_image(self.effector_body, tuple(self.body_agent), bodies, "body")

    def action_space(self, effectors: Sequence[str]) -> spaces.Box:
        """A(E'): the product of the effectors' intervals, one dimension an effector."""
        import numpy as np
        from gymnasium import spaces

        bounds = np.array([self.actions[e] for e in effectors], dtype=np.float64).reshape(-1, 2)
        return spaces.Box(bounds[:, 0], bounds[:, 1], dtype=np.float64)

    def agent_space(self, agent: str) -> spaces.Box:
        """A(E(B({i}))): the actions of one agent (Definition 2)."""
        return self.action_space(self.effectors(self.bodies([agent])))


def model_of(teams: Mapping[str, Sequence[Body]]) -> AgentBodyEffectorModel:
    """The model in which each agent owns the bodies given, each with throttle and steering."""
    bodies = [(agent, body) for agent, owned in teams.items() for body in owned]
    _once("body", [body.id for _, body in bodies])
    limits = {
        body.id: {
            THROTTLE: (body.kind.throttle_min, body.kind.throttle_max),
            STEERING: (-body.kind.steering_max, body.kind.steering_max),
        }
        for _, body in bodies
    }
    return AgentBodyEffectorModel(
        agents=tuple(teams),
        body_agent={body.id: agent for agent, body in bodies},
        effector_body={effector(b, name): b for b, names in limits.items() for name in names},
        actions={
            effector(b, n): limit for b, names in limits.items() for n, limit in names.items()
        },
    )


def _once(what: str, names: Sequence[str]) -> None:
    """Refuse a name that is given twice: a function has one value."""
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError(f"{what} {twice[0]!r} is named twice in the agent-body-effector model")


def _surjection(
    domain: str, mapping: Mapping[str, str], codomain: str, onto: Iterable[str]
) -> None:
    """Refuse a map that leaves its codomain or does not cover it."""
    targets = set(onto)
    if not targets:
        raise InputError(f"an agent-body-effector model needs {codomain}, got none")
    for x, y in mapping.items():
        if y not in targets:
            raise UnknownName(f"image of {x!r} among the {codomain}", y, targets)
    bare = sorted(targets - set(mapping.values()))
    if bare:
        raise InputError(
            f"no {domain} for {', '.join(bare)}: {domain} -> {codomain} is no surjection"
        )


def _inverse_image(
    mapping: Mapping[str, str], codomain: tuple[str, ...], chosen: Iterable[str], what: str
) -> tuple[str, ...]:
    """f^-1 of a set, in the order of the mapping."""
    wanted = set(chosen)
    for name in sorted(wanted - set(codomain)):
        raise UnknownName(what, name, codomain)
    return tuple(x for x, y in mapping.items() if y in wanted)
