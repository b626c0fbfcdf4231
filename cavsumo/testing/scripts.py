"""Scripted drives on a real network, without SUMO, for egos, agents and assertions.

The ego's way, the carriageways and the lights are those of a network file. All other bodies follow
a script, so that the same drive can be repeated number for number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cavsumo.egos.base import Acceleration, Command, Drive, Ego, Mission
from cavsumo.model.bodies import BICYCLE, BUS, CAR, PEDESTRIAN, Action, Body, Kind
from cavsumo.model.kinematics import step_floats
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, RawState, Snapshot
from cavsumo.network.site import Site, derive_site

DT = 0.1  # s
SPEED = 8.0  # of an ego without a start speed [m/s]
CROWD = (PEDESTRIAN, CAR, BICYCLE, PEDESTRIAN, BUS, PEDESTRIAN)
LETTERS = "rrruGGGGgy"  # shown for 3 s each
TESTERS = 3


@dataclass(frozen=True)
class ScriptNetwork:
    """A network on which scripts are played, and the timestep [s]."""

    site: Site
    dt: float = DT

    def mission(self, steps: int) -> Mission:
        """The data that an ego has before its first episode."""
        site, route = self.site, self.site.route
        return Mission(
            site.net,
            route.edges,
            route.path,
            site.lights,
            self.dt,
            steps * self.dt,
            crossings=site.marked,
            surroundings=site.surroundings,
        )

    def scene(self, ego: Kind, seed: int, testers: int = TESTERS) -> Scene:
        """A scene with tester pedestrians on the pavements beside the ego's way."""
        site, kinds = self.site, [PEDESTRIAN] * testers
        starts = site.draw(kinds, ego, None, np.random.default_rng(seed))
        bodies = tuple(Body(f"tester{i}", kind) for i, kind in enumerate(kinds))
        driver = Body("ego", ego)
        return site.scene(self.dt, driver, bodies, starts, seed)


Shown = tuple[Snapshot, Command]  # a snapshot and what the ego answered
Others = Callable[[Scene, int], tuple[RawState, ...]]


@dataclass(frozen=True)
class Script:
    """A scripted drive.

    Attributes:
        steps: how many timesteps.
        others: the background bodies at each of them.
        held: the ego is kept standing against its commands, as in a jam.
        testers: how many tester pedestrians stand on the pavements.
        letters: the states of the traffic lights in turn.
    """

    steps: int
    others: Others
    held: bool = False
    testers: int = TESTERS
    letters: str = LETTERS


def ground(net: Path, ego: Kind, dt: float = DT) -> ScriptNetwork:
    """The ground that a network offers; raises InputError as ``cavsumo run`` does."""
    return ScriptNetwork(derive_site(net, (), None, ego), dt)


# Scripts


def nobody(scene: Scene, step: int) -> tuple[RawState, ...]:
    """An empty road."""
    return ()


def crowd(scene: Scene, step: int) -> tuple[RawState, ...]:
    """Sixty bodies of all kinds on both sides of the ego's way, moving along it or standing."""
    path, found = scene.ego_path, []
    for i in range(60):
        kind = CROWD[i % len(CROWD)]
        v = (i % 5) * 0.25 * min(kind.v_max, 8.0)
        along = (i / 60 * path.length + v * step * scene.dt) % path.length
        x, y, o = path.at(along)
        side = (4.0 + 1.5 * (i % 6)) * (1.0 if i % 2 else -1.0)
        found.append(_raw(f"other{i}", kind, x - side * math.sin(o), y + side * math.cos(o), v, o))
    return tuple(found)


def oddities(scene: Scene, step: int) -> tuple[RawState, ...]:
    """Numbers and names that are valid but rare."""
    x, y, o = scene.ego_path.at(scene.ego_path.length / 2)
    return (
        _raw("far", CAR, 1e9, -1e9, 0.0, math.pi),
        _raw("tiny", PEDESTRIAN, x + 5e-324, y + 20.0, 5e-324, math.nextafter(-math.pi, 0.0)),
        _raw("minus zero", BUS, x, y + 30.0, -0.0, -0.0),
        _raw("digits", BICYCLE, x + 0.1 + 0.2, y + 40.0, 1 / 3, 1e-17),
        _raw('quotes " \\ and \u00e4\u6f22\U0001f6b2', CAR, x, y + 50.0, 55.0, o),
        _raw("", PEDESTRIAN, x, y + 60.0, 1e-300, math.pi / 2),
    )


# No body to brake for and no red light: an ego that stands there does not drive at all.
EMPTY, CROWDED = Script(200, nobody, testers=0, letters="G"), Script(200, crowd)
ODD, LONG = Script(50, oddities), Script(6000, nobody, held=True)


def drive(
    ego: Ego, ground: ScriptNetwork, script: Script, seed: int
) -> Iterator[tuple[Snapshot, Command]]:
    """Play a script to an ego: each snapshot with its answer, until it has arrived.

    An ego that leaves the driving to SUMO (answers None) keeps its speed.
    """
    scene = ground.scene(ego.kind, seed, script.testers)
    testers = tuple(
        BodyState(body, start.x, start.y, 0.0, start.o)
        for body, start in zip(scene.bodies, scene.starts, strict=True)
    )
    ego.reset(scene)
    along, steering = 0.0, 0.0
    v = 0.0 if script.held else SPEED if ego.depart_speed is None else ego.depart_speed
    state = BodyState(scene.ego, *_pose(scene, along, v))
    for step in range(script.steps):
        others, lights = script.others(scene, step), _lights(scene, step, script.letters)
        time = round(step * scene.dt, 6)
        snapshot = Snapshot(step, time, state, steering, testers, others, lights)
        command = ego.act(snapshot)
        yield snapshot, command
        if script.held:
            continue
        if isinstance(command, Drive):
            state, steering = driven(state, command, scene.dt), command.steering
            along = scene.ego_path.project(state.x, state.y).along
        else:
            along += state.v * scene.dt
            state = BodyState(scene.ego, *_pose(scene, along, _speed(state, command, scene.dt)))
        if along >= scene.ego_path.length:
            break
    ego.conclude()


def _pose(scene: Scene, along: float, v: float) -> tuple[float, float, float, float]:
    """x, y, v, o of an ego so far along its way."""
    x, y, o = scene.ego_path.at(min(along, scene.ego_path.length))
    return x, y, v, o


def _speed(state: BodyState, command: Command, dt: float) -> float:
    """The speed after a timestep."""
    kind = state.body.kind
    a = command.value if isinstance(command, Acceleration) else 0.0
    return min(kind.v_max, max(kind.v_min, state.v + a * dt))


def driven(state: BodyState, action: Action | Drive, dt: float) -> BodyState:
    """A body after a timestep with an action of its effectors."""
    (body, x, y, v, o), (throttle, steering) = state, action
    kind = body.kind
    limits = kind.wheelbase, kind.v_min, kind.v_max
    return BodyState(body, *step_floats(x, y, v, o, throttle, steering, *limits, dt))


def _lights(scene: Scene, step: int, letters: str) -> tuple[str, ...]:
    """The states of the lights: for each its letters in turn."""
    turn = int(step * scene.dt / 3.0)
    return tuple(letters[(turn + i) % len(letters)] for i in range(len(scene.lights)))


def _raw(name: str, kind: Kind, x: float, y: float, v: float, o: float) -> RawState:
    return Body(name, kind), x, y, v, o
