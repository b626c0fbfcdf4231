"""The sensor model: the view of an observer, if observability is not full.

An observer is the ego, or a tester agent with all its bodies. It knows its own state exactly and
without delay. It has *measurements* of the other bodies. The measurement of a timestep holds

* the bodies within ``range_m`` of one of its eyes, the centres of its own bodies, centre to centre,
  and visible from that eye past the vehicles of others, if ``occlusion`` is on;
* for each of them x + N(0, position_noise_m), y + N(0, position_noise_m), v + N(0, speed_noise_mps)
  and o + N(0, heading_noise_rad): independent of each other, of the body and of the timestep. A
  speed that is not negative stays so, orientations are wrapped;
* the traffic lights whose stop lines are within ``range_m``, without occlusion and errors.

* A body of a script with ``errors_m`` has these added, for the ego alone.

At the time t the observer receives the measurement of t - ``delay_s``, rounded to timesteps; at
the start of an episode, when there is none so old, the first.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from cavsumo.model.bodies import BICYCLE, PEDESTRIAN
from cavsumo.model.geometry import Point
from cavsumo.model.kinematics import wrap
from cavsumo.model.occlusion import in_sight
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.model.scenario.sensor import Sensor
from cavsumo.model.scenario.track import Place
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, RawState, Snapshot

SEEN_PAST = (PEDESTRIAN.name, BICYCLE.name)  # kinds that hide nobody


class Measurement(NamedTuple):
    """The measurement of one timestep; None for a body that the sensor does not see."""

    ego: BodyState | None
    steering: float
    testers: tuple[BodyState | None, ...]
    background: tuple[RawState, ...]
    lights: tuple[str, ...]


class Observer:
    """The ego or a tester agent with its sensor, in one episode.

    Args:
        own: indices of the testers that are its own; None for the ego.
        rng: for the noise, this observer's alone. Four numbers are drawn for each body of others
            in each timestep, seen or not, if there is any noise.
    """

    def __init__(
        self, sensor: Sensor, scene: Scene, own: Sequence[int] | None, rng: np.random.Generator
    ) -> None:
        self._sensor, self._own, self._rng = sensor, own, rng
        self._range = math.inf if sensor.range_m is None else sensor.range_m
        self._noise = np.array(sensor.noise) if any(sensor.noise) else None
        self._errors = {} if own is not None else scripted_errors(scene.script)
        self._past: deque[Measurement] = deque(maxlen=1 + round(sensor.delay_s / scene.dt))
        self._lights = [scene.ego_path.at(light.along)[:2] for light in scene.lights]
        # Where a tester agent takes bodies to be before it has seen them.
        x, y, o = scene.ego_path.at(0.0)
        self._ego, self._steering = BodyState(scene.ego, x, y, 0.0, o), 0.0
        self._testers = [
            BodyState(body, start.x, start.y, 0.0, start.o)
            for body, start in zip(scene.bodies, scene.starts, strict=True)
        ]

    def view(self, snapshot: Snapshot) -> Snapshot:
        """The view of the observer; called once for each timestep, in their order."""
        self._past.append(self._measure(snapshot))
        seen = self._past[0]
        if self._own is not None:
            return self._remembered(snapshot, seen)
        testers = tuple([t for t in seen.testers if t is not None])
        return snapshot._replace(
            testers=testers,
            raw_background=seen.background,
            lights=seen.lights,
            crossing_lights=(),
        )

    def _remembered(self, snapshot: Snapshot, seen: Measurement) -> Snapshot:
        """A tester agent's view: unseen bodies have their last seen states, and are named."""
        own, unseen = self._own or (), []
        if seen.ego is None:
            unseen.append(self._ego.id)
        else:
            self._ego, self._steering = seen.ego, seen.steering
        for i, state in enumerate(seen.testers):
            if i in own:
                self._testers[i] = snapshot.testers[i]
            elif state is None:
                unseen.append(self._testers[i].id)
            else:
                self._testers[i] = state
        return snapshot._replace(
            ego=self._ego,
            ego_steering=self._steering,
            testers=tuple(self._testers),
            raw_background=seen.background,
            lights=seen.lights,
            unseen=frozenset(unseen),
            crossing_lights=(),
        )

    def _measure(self, snapshot: Snapshot) -> Measurement:
        """The measurement of this timestep."""
        (_, _, ego, steering, testers, background, *_), own = snapshot, self._own
        mine = [ego] if own is None else [testers[i] for i in own]
        eyes = [(state.x, state.y) for state in mine]
        ids = {state.id for state in mine}
        others = [other for other in (ego, *testers, *background) if other[0].id not in ids]
        found = {state[0].id: state for state in self._look(eyes, others)}
        for name, errors in self._errors.items():
            if name in found and snapshot.step < len(errors):
                found[name] = _shifted(found[name], *errors[snapshot.step], 0.0, 0.0)
        known = [found.get(state.id) for state in (ego, *testers)]
        first, *rest = [state and BodyState._make(state) for state in known]
        return Measurement(
            first,
            steering,
            tuple(rest),
            tuple(found[body.id] for body, *_ in background if body.id in found),
            self._lights_within(eyes, snapshot.lights),
        )

    def _look(self, eyes: Sequence[Point], others: Sequence[RawState]) -> Iterator[RawState]:
        """The measured states of the visible others."""
        seen = self._seen(eyes, others)
        if self._noise is None:
            yield from (other for other, known in zip(others, seen, strict=True) if known)
            return
        errors = (self._rng.standard_normal((len(others), 4)) * self._noise).tolist()
        for other, known, error in zip(others, seen, errors, strict=True):
            if known:
                yield _shifted(other, *error)

    def _seen(self, eyes: Sequence[Point], others: Sequence[RawState]) -> list[bool]:
        """Whether any of the eyes sees each of the others."""
        seen = [False] * len(others)
        for eye in eyes:
            away = [math.dist(eye, (x, y)) for _, x, y, _, _ in others]
            within = [i for i, distance in enumerate(away) if distance <= self._range]
            hidden = self._hidden(eye, others, away) if self._sensor.occlusion else set()
            for i in within:
                if i not in hidden:
                    seen[i] = True
        return seen

    def _hidden(self, eye: Point, others: Sequence[RawState], away: Sequence[float]) -> set[int]:
        """The bodies in range that are hidden from an eye."""
        # Who hides a body in range is no farther than its reach and their own beyond the range.
        beyond = 2.0 * max((other[0].kind.reach for other in others), default=0.0)
        near = [i for i, distance in enumerate(away) if distance <= self._range + beyond]
        boxes = [BodyState._make(others[i]).box for i in near]
        hiding = [others[i][0].kind.name not in SEEN_PAST for i in near]
        clear = in_sight(eye, boxes, hiding)
        return {i for i, free in zip(near, clear, strict=True) if not free}

    def _lights_within(self, eyes: Sequence[Point], letters: tuple[str, ...]) -> tuple[str, ...]:
        """The letters of the traffic lights in range, an empty one for every other."""
        return tuple(
            letter if min(math.dist(eye, light) for eye in eyes) <= self._range else ""
            for letter, light in zip(letters, self._lights, strict=True)
        )


def scripted_errors(script: ScriptedTest | None) -> dict[str, tuple[Place, ...]]:
    """The errors with which a script has the ego measure its testers, by their ids."""
    bodies = zip(script.bodies, script.testers, strict=True) if script else ()
    return {body.id: tester.errors_m for body, tester in bodies if tester.errors_m}


class Senses:
    """All observers of an episode.

    Args:
        ego, testers: the sensors of the ego and of every tester agent; None for a perfect one.
        teams: for each agent the indices of the bodies that it owns.
        rngs: generators of the ego's noise and of each agent's.
    """

    def __init__(
        self,
        scene: Scene,
        ego: Sensor | None,
        testers: Sensor | None,
        teams: Sequence[Sequence[int]],
        rngs: Sequence[np.random.Generator],
    ) -> None:
        self._ego = None if ego is None else Observer(ego, scene, None, rngs[0])
        self._agents = [
            None if testers is None else Observer(testers, scene, team, rng)
            for team, rng in zip(teams, rngs[1:], strict=True)
        ]

    def views(self, snapshot: Snapshot) -> tuple[Snapshot, tuple[Snapshot, ...]]:
        """The views of the ego and of each agent; called once for each timestep, in their order."""
        ego = snapshot if self._ego is None else self._ego.view(snapshot)
        return ego, tuple([snapshot if a is None else a.view(snapshot) for a in self._agents])


def _shifted(state: RawState, dx: float, dy: float, dv: float, do: float) -> RawState:
    """A state with errors added; a speed that is not negative stays so."""
    body, x, y, v, o = state
    return body, x + dx, y + dy, max(min(v, 0.0), v + dv), wrap(o + do)
