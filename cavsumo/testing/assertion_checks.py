"""Requirements on every assertion: checks that show it encounters of an ego and a tester."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from cavsumo.assertions.base import NOT_TRIGGERED, SEVERITY, VIOLATED, Assertion, Judgement
from cavsumo.assertions.contacts import Contact, ContactMonitor
from cavsumo.egos.base import EGO_KIND
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot
from cavsumo.testing.scripts import Others, ScriptNetwork, crowd, nobody, oddities

MakeAssertion = Callable[[], Assertion]
Check = Callable[[MakeAssertion, ScriptNetwork], str]
Frame = tuple[Snapshot, list[Contact]]
ENCOUNTERS, STEPS = 30, 150


def encounter(
    ground: ScriptNetwork, seed: int, others: Others = nobody
) -> tuple[Scene, list[Frame]]:
    """An ego that drives its way and brakes at some moment, and a tester who crosses at another."""
    scene = ground.scene(EGO_KIND, seed, 1)
    rng = np.random.default_rng(seed)
    speed, reacts = rng.uniform(3.0, 12.0), rng.random() < 0.5
    meet, walk = rng.uniform(15.0, 0.8 * scene.ego_path.length), rng.uniform(0.5, 1.4)
    early = rng.normal(0.0, 2.0)  # how long before the ego the tester is on its way [s]
    lead = meet / speed - early
    monitor, frames = ContactMonitor(), []
    along, v = 0.0, speed
    for step in range(STEPS):
        time = round(step * ground.dt, 6)
        ego = BodyState(scene.ego, *_posed(scene, along, 0.0, v))
        aside = walk * (time - lead)  # from the middle of the ego's way
        x, y, _, o = _posed(scene, meet, aside, walk)
        tester = BodyState(scene.bodies[0], x, y, walk, o + math.pi / 2)
        snapshot = Snapshot(step, time, ego, 0.0, (tester,), others(scene, step))
        frames.append((snapshot, monitor.observe(snapshot)))
        braking = reacts and abs(aside) < 3.0 and along < meet
        along = min(along + v * ground.dt, scene.ego_path.length)
        v = max(0.0, v - 8.0 * ground.dt) if braking else v
    return scene, frames


def judged(assertion: Assertion, scene: Scene, frames: list[Frame]) -> Iterator[Judgement]:
    """The judgements of an assertion after each snapshot and at the end, each checked."""
    assertion.reset(scene)
    final: Judgement | None = None
    for snapshot, contacts in frames:
        assertion.observe(snapshot, contacts)
        said, at = assertion.judgement, f"at {snapshot.time:g} s"
        check_judgement(assertion, said, snapshot.time, at)
        assert final is None or said == final, f"{at}: changed what was decided to {said}"
        final = said if assertion.decided else None
        yield said
    assertion.conclude()
    check_judgement(assertion, assertion.judgement, frames[-1][0].time, "at the end")
    assert final in (None, assertion.judgement), f"at the end: changed what was decided, {final}"
    yield assertion.judgement


def check_judgement(assertion: Assertion, said: Judgement, now: float, at: str) -> None:
    """Check that a judgement is consistent."""
    assert said.assertion == assertion.name, f"{at}: judges in the name of {said.assertion!r}"
    assert said.verdict in SEVERITY, f"{at}: no such verdict: {said.verdict!r}"
    assert not (assertion.decided and assertion.pending), f"{at}: decided and pending"
    begun, broken = said.trigger_time, said.violation_time
    assert (begun is not None) == said.triggered or said.verdict not in (
        NOT_TRIGGERED,
        VIOLATED,
    ), f"{at}: {said.verdict} with trigger time {begun}"
    assert (broken is not None) == (said.verdict == VIOLATED), (
        f"{at}: {said.verdict} with violation time {broken}"
    )
    times = [t for t in (begun, broken) if t is not None]
    assert times == sorted(times), f"{at}: violated at {broken} s, triggered at {begun} s"
    assert all(0.0 <= t <= now for t in times), f"{at}: a time to come: {times}"


# The checks


def check_encounters(make: MakeAssertion, ground: ScriptNetwork) -> str:
    """Thirty encounters: every judgement is consistent, and decided judgements stay."""
    assertion, found = make(), []
    for seed in range(ENCOUNTERS):
        found.append([*judged(assertion, *encounter(ground, seed))][-1].verdict)
    return ", ".join(f"{found.count(v)} {v}" for v in SEVERITY if v in found)


def check_reset_forgets(make: MakeAssertion, ground: ScriptNetwork) -> str:
    """The same encounter gets the same judgement, also after other encounters."""
    used = make()
    for seed in range(10):
        scene, frames = encounter(ground, seed)
        again = list(judged(used, scene, frames))
        assert again == list(judged(make(), scene, frames)), f"encounter {seed} is judged anew"
    return "10 encounters judged alike"


def check_sees_what_it_says(make: MakeAssertion, ground: ScriptNetwork) -> str:
    """An assertion with ``sees_background = False`` does not use the background."""
    if make().sees_background:
        return "looks at the background"
    for seed in range(10):
        scene, frames = encounter(ground, seed, crowd)
        bare = [(snapshot._replace(raw_background=()), contacts) for snapshot, contacts in frames]
        assert list(judged(make(), scene, frames)) == list(judged(make(), scene, bare))
    return "the background changes nothing"


def check_odd_numbers(make: MakeAssertion, ground: ScriptNetwork) -> str:
    """Tiny, huge and negative numbers, names with quotes."""
    count = sum(1 for _ in judged(make(), *encounter(ground, 1, oddities)))
    return f"{count} snapshots"


CHECKS: Mapping[str, Check] = {
    "encounters": check_encounters,
    "reset forgets": check_reset_forgets,
    "sees what it says": check_sees_what_it_says,
    "odd numbers": check_odd_numbers,
}


def _posed(scene: Scene, along: float, aside: float, v: float) -> tuple[float, float, float, float]:
    """x, y, v, o at an arc length of the ego's way, so far to the left of it."""
    x, y, o = scene.ego_path.at(along)
    return x - aside * math.sin(o), y + aside * math.cos(o), v, o
