"""Best response: from counts of the ego to a decision process to a tester, and that in SUMO."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cavsumo.agents import AGENTS
from cavsumo.agents.best_response import LONGEST_NOTICE_S, notice_of
from cavsumo.agents.planning import grid, moves, response, solving
from cavsumo.agents.planning.coordinates import Coordinates
from cavsumo.agents.planning.grid import (
    SPEEDS,
    ZETAS,
    States,
    braking,
    corners,
    grid_for,
    scale,
)
from cavsumo.agents.planning.moves import (
    HUMAN_DECEL,
    HUMAN_REACTION_S,
    STAND,
    WALK,
    Aim,
    move,
)
from cavsumo.agents.planning.opponent import KEEPS, OLDEST, AccelerationReader, Counts, situation
from cavsumo.agents.planning.solving import best_response, chain, layer, roll_out, unsolved
from cavsumo.egos.reference.encounter import EVALUATION_S
from cavsumo.egos.reference.human import DELAY_S, FULL_MPS2, RISE_S
from cavsumo.errors import InputError
from cavsumo.model.scene import Scene

DT = 0.1


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A coarse grid, which is solved in a moment."""
    monkeypatch.setattr(grid, "BEFORE_S", 1.0)
    monkeypatch.setattr(solving, "ROLLOUTS", 10)
    for module in (grid, moves, solving):
        monkeypatch.setattr(module, "ZETAS", ZETAS[::3])
    for module in (grid, solving):
        monkeypatch.setattr(module, "SPEEDS", SPEEDS[::2])


def watched(accelerations: list[float], v: float = 8.0) -> list[tuple[int, bool | None]]:
    """Age and whether it was chosen anew, after each timestep of an ego."""
    watch, seen = AccelerationReader(DT), []
    watch.see(v)
    for a in accelerations:
        v = max(0.0, v + a * DT)
        watch.see(v)
        seen.append((watch.held, watch.changed))
    return seen


def driver(period: int, reaction: float) -> Counts:
    """Of an ego that decides once in a period: it keeps its speed, and brakes when it sees you."""
    counts = Counts()
    for entry_s, a in ((math.inf, 0.0), (0.3, reaction), (0.0, reaction)):
        for gap in (1.0, 2.0, 3.0, 4.0, 6.0, 9.0, 20.0):
            for v in (2.0, 5.0, 8.0):
                for held in range(period):
                    for _ in range(20):
                        changed = held == period - 1
                        counts.add(situation(entry_s, gap, v), held, a, changed=changed)
    return counts


# Counting -----------------------------------------------------------------------------------------


def test_the_age_of_an_acceleration_is_seen_from_outside() -> None:
    """The first was chosen as the ego entered; another one begins at age 0."""
    assert watched([0.5, 0.5, -1.0, -1.0]) == [(0, None), (1, False), (0, True), (1, False)]


def test_a_standing_ego_shows_no_decision() -> None:
    """It may decide what it likes; when it moves off, that is a new one."""
    assert watched([-9.0, 0.0, 2.0, 2.0], 0.5) == [
        (OLDEST, None), (OLDEST, None), (0, True), (1, False)
    ]  # fmt: skip


def test_hazards_are_shares_of_what_was_counted() -> None:
    """Held 60 times at age 3 and changed 20 times, with two pseudo-counts for the pooled share."""
    counts = Counts()
    for changed in [False] * 60 + [True] * 20:
        counts.add(situation(math.inf, 50.0, 8.0), 3, -1.0, changed=changed)
    assert counts.hazard(0, 3) == pytest.approx((20 + 2 * 21 / 81) / 82)
    assert counts.hazard(0, 5) == 1.0, "an ego of which nothing is known decides at any time"


def test_an_unseen_situation_keeps_its_speed() -> None:
    """Nothing counted: all on the class around 0; counts of the same entry speak first."""
    counts = Counts()
    assert counts.chances(situation(0.3, 5.0, 8.0))[KEEPS] == 1.0
    for _ in range(6):
        counts.add(situation(0.3, 5.0, 8.0), 0, -4.5, changed=True)
    share = 0.0
    shares = [share := (6 + 2 * share) / 8 for _ in range(4)]
    alike = (situation(0.5, 50.0, 2.0), situation(0.5, 5.0, 8.0), situation(0.3, 5.0, 7.9))
    for key, expected in zip(alike, (shares[0], shares[1], shares[3]), strict=True):
        assert counts.chances(key) == pytest.approx([0, expected, 0, 0, 1 - expected, 0])


def test_floors_hold_together() -> None:
    """Clopper-Pearson at a sixth of the risk: k of n is then as likely as that risk (19 of 20)."""
    counts, key = Counts(), situation(0.3, 5.0, 8.0)
    for a in [-4.5] * 19 + [0.0]:
        counts.add(key, 0, a, changed=True)
    floors, risk = counts.floor(key, 0.9), 0.1 / 6
    p, q = floors[1], floors[4]
    assert p**20 + 20 * p**19 * (1 - p) == pytest.approx(risk)
    assert 1 - (1 - q) ** 20 == pytest.approx(risk)
    assert [floors[k] for k in (0, 2, 3, 5)] == [0.0] * 4


def test_counts_are_plain_data() -> None:
    """Through JSON and back they are the same."""
    counts = driver(5, -4.5)
    again = Counts.of(json.loads(json.dumps(counts.plain())))
    assert again.plain() == counts.plain()


# From counts to a game ----------------------------------------------------------------------------


def one(entry: float, gap: float, v: float, held: int = 0) -> States:
    """A state."""
    return States(np.array([entry]), np.array([gap]), np.array([v]), np.array([held]))


def test_a_timestep_is_the_kinematics() -> None:
    """SUMO moves by the new speed; walking brings the entry nearer."""
    grid = grid_for(driver(10, -4.5), DT)
    for action, entry in ((STAND, 8.0), (WALK, 7.0)):
        after = move(
            one(8, 20.0, 8.0), np.array([action]), np.array([-5.0]), np.array([3]), grid, Aim()
        )
        assert after.states.entry == entry
        assert after.states.v == pytest.approx(7.5)
        assert after.states.gap == pytest.approx(20.0 - 0.75)


def test_an_ego_that_keeps_its_speed_keeps_its_zeta() -> None:
    """So a walk on the grid is not blurred: one corner has all the weight, and the same zeta."""
    grid = grid_for(driver(10, -4.5), DT)
    i, k = 6, 3
    v, entry = SPEEDS[k], 8
    gap = braking(v) + ZETAS[i] * scale(v) + v * entry * DT
    after = move(one(entry, gap, v), np.array([WALK]), np.zeros(1), np.array([1]), grid, Aim())
    places, weights = corners(after.states, np.array([KEEPS]), grid)
    found = {tuple(int(x) for x in np.unravel_index(p, grid.shape)): w
             for p, w in zip(places[:, 0], weights[:, 0], strict=True) if w > 1e-9}  # fmt: skip
    assert found == {(entry - 1 + grid.inside, i, k, 1, KEEPS): pytest.approx(1.0)}


@pytest.mark.parametrize(
    ("gap", "v", "price"),
    [
        (1.0, 8.0, 2.0),  # in the braking zone, which is 3.6 m long: unfair
        (-9.0, 8.0, 1.0),  # behind the ego: nothing
        (4.0, 0.05, 1.0),  # before a standing ego: nothing
    ],
)
def test_entering_at_the_wrong_moment_has_its_price(gap: float, v: float, price: float) -> None:
    """Whoever enters there has missed his test, or spoilt it."""
    grid = grid_for(driver(10, -4.5), DT)
    after = move(one(1, gap + v * DT, v), np.array([WALK]), np.zeros(1), np.array([1]), grid, Aim())
    assert after.over == pytest.approx(1.0)
    assert after.price == pytest.approx(price)


def test_a_hit_in_the_strip_is_free_and_a_stop_is_not() -> None:
    """A violation costs nothing; an ego that stands was held."""
    grid = grid_for(driver(10, -4.5), DT)
    hit = move(one(-3, 0.5, 8.0), np.array([WALK]), np.zeros(1), np.array([1]), grid, Aim())
    assert (hit.over, hit.price) == (1.0, 0.0)
    stop = move(one(-3, 0.5, 0.5), np.array([WALK]), np.array([-9.0]), np.array([1]), grid, Aim())
    assert (stop.over, stop.price) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("notice", "inside", "price"),
    [  # at 8 m/s a human needs 1.45 s and 8 / (2 * 7.59) s
        (None, 3, 0.0),
        (2.5, 3, 0.0),
        (1.5, 6, 0.25),
        (0.5, 3, 1.0),
    ],
)
def test_a_hit_that_nobody_could_have_prevented_has_a_price(
    notice: float | None, inside: int, price: float
) -> None:
    """A human sees the body as long as it is on the road before the strip, and in it."""
    grid, aim = grid_for(driver(10, -4.5), DT), Aim(notice=notice)
    steps = one(1 - inside, 0.5, 8.0), np.array([WALK]), np.zeros(1), np.array([1])
    after = move(*steps, grid, aim)
    assert after.over == 1.0
    assert after.price == pytest.approx(price, abs=0.2)
    assert HUMAN_REACTION_S == EVALUATION_S + DELAY_S + RISE_S / 2
    assert HUMAN_DECEL == FULL_MPS2


def test_a_body_is_noticed_for_as_long_as_it_is_on_the_road(
    straight_scene: Callable[..., Scene],
) -> None:
    """From the near kerb it walks 0.68 m to the strip, from the far one 4.33 m, at 1.4 m/s."""
    scene = straight_scene([(60.0, -5.15, 0.0), (60.0, 5.15, 0.0)])
    assert [notice_of(Coordinates(scene, i)) for i in (0, 1)] == [0.5, LONGEST_NOTICE_S]


def test_a_committed_body_is_hit_by_an_ego_that_does_not_look() -> None:
    """Never braking, it hits who enters at 5 m/s 2.5 m before it, and that is known for certain."""
    counts = driver(1, 0.0)
    plan = unsolved(counts, DT, Aim())
    chain(plan)
    worth = plan.back_up(one(2, 2.5 + 1.0, 5.0), np.array([WALK]), np.zeros(1), np.array([KEEPS]))
    assert worth.worth == pytest.approx(0.0, abs=0.05)


def test_the_solution_satisfies_the_bellman_equation(small: None) -> None:
    """Backed up, the values of states that can still choose stay within precision."""
    plan = best_response(driver(2, -4.5), DT, Aim())
    grid = plan.grid
    assert grid.ages == 2
    states, which = layer(grid, grid.committed + 1)
    moves = [
        plan.back_up(states, np.full(len(which), m), plan.model.middles[which], which).worth
        for m in (STAND, WALK)
    ]
    start = (grid.committed + 1 + grid.inside) * grid.layer
    value = plan.value[start : start + grid.layer]
    assert np.abs(np.max(moves, axis=0) - value).max() < 2 * response.PRECISION


def test_the_phase_of_the_driver_decides() -> None:
    """An ego that decides once a second is hit by who enters just after it decided, not before."""
    plan = unsolved(driver(10, -8.0), DT, Aim())
    roll_out(plan)
    gap = 5.0 + 8.0 * 0.9
    fresh, due = (
        plan.back_up(one(9, gap, 8.0, held), np.array([WALK]), np.zeros(1), np.array([KEEPS]))
        for held in (8, 4)
    )
    assert fresh.worth > due.worth + 0.5


def test_distrust_costs(small: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """With sets around few counts every state is worth at most what the counts say."""
    monkeypatch.setattr(solving, "roll_out", chain)
    counts = driver(2, -4.5)
    trusting = best_response(counts, DT, Aim())
    robust = best_response(counts, DT, Aim(confidence=0.9))
    assert (robust.value <= trusting.value + 2 * response.PRECISION).all()
    assert (robust.value < trusting.value - 0.1).any()


def test_a_test_is_easier_than_a_violation(small: None) -> None:
    """What ends in a fair collision was a fair test before."""
    counts = driver(2, -4.5)
    violation = best_response(counts, DT, Aim())
    test = best_response(counts, DT, dataclasses.replace(Aim(), violation=False))
    assert (test.value >= violation.value - 0.1).all()


# The tester ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"learn": False}, "model=FILE"),
        ({"model": "nowhere.json"}, "nowhere.json"),
        ({"aim": "crash"}, "aim"),
        ({"confidence": 1.5}, "confidence"),
        ({"unfair": -1.0}, "unfair"),
    ],
)
def test_what_cannot_be_played_is_refused(params: dict[str, Any], said: str) -> None:
    """In one sentence that names the parameter."""
    with pytest.raises(InputError, match=f"agent best-response: .*{said}"):
        AGENTS.make("best-response", params)


@pytest.mark.parametrize(
    ("key", "value"),
    [("ages", []), ("sums", [[0.0, 1]]), ("taken", {"1,2,3": [1]}), ("taken", {"a": [0] * 6}),
     ("taken", {"1,2,3": [-1] * 6}), ("sums", [[math.nan, 0]] * 6), ("taken", [1])],
)  # fmt: skip
def test_damaged_counts_are_refused(tmp_path: Path, key: str, value: Any) -> None:
    """Before anything is played, in one sentence."""
    file = tmp_path / "model.json"
    file.write_text(json.dumps({"counts": {**driver(1, -4.5).plain(), key: value}}))
    with pytest.raises(InputError, match="agent best-response: model"):
        AGENTS.make("best-response", {"model": str(file)})


@pytest.mark.parametrize("text", ["", "[]", '{"counts": {}}', '{"learned": {"timing": null}}'])
def test_a_file_without_counts_is_refused(tmp_path: Path, text: str) -> None:
    """It says what was expected."""
    file = tmp_path / "model.json"
    file.write_text(text)
    with pytest.raises(InputError, match="expected the manifest of a batch"):
        AGENTS.make("best-response", {"model": str(file)})
