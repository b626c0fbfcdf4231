"""From traffic to a game: coordinates, the lattice, its solution, and what is kept on disk."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cavsumo.agents.planning import solved as solutions
from cavsumo.agents.planning.coordinates import Coordinates, Relative
from cavsumo.agents.planning.forceability import ConstantSpeed, Free, Unaware
from cavsumo.agents.planning.lattice import build
from cavsumo.agents.planning.rules import Rules, against_any, against_constant
from cavsumo.agents.planning.solved import Solved, solved
from cavsumo.agents.triggers import time_to_walk
from cavsumo.games import solve, sure_region
from cavsumo.model.bodies import PEDESTRIAN
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import Snapshot

MakeScene = Callable[..., Scene]
See = Callable[..., Snapshot]

B, R = 9.0, 0.675  # the zones of the key assertion
SMALL = against_constant(PEDESTRIAN, R, 2.0, 0.01, 0.125)
FREE = against_any(
    PEDESTRIAN, max_decel=B, reaction_time=R, top=9.0, accel=4.5, left_max=1.5, price=0.01
)
BOTH = pytest.mark.parametrize("rules", [SMALL, FREE], ids=["constant", "free"])


def test_coordinates_by_hand(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """The ego's lane is centred on y = -1.825, 1.75 m of it are swept; the body starts south."""
    scene = straight_scene(((60.0, -5.15, 0.0),))
    snapshot = scene_snapshot(scene, ego=(10.0, 8.0), testers=[(60.0, -5.15, 0.0, math.pi / 2)])
    here = Coordinates(scene, 0)(snapshot)
    assert here is not None
    assert here.gap == pytest.approx(60.0 - 0.875 / 2 - 10.0 - 4.5 / 2)
    assert here.left == pytest.approx(5.15 - 1.825 - 0.875 - 0.65625 / 2)
    assert (here.v, here.walk, here.turn) == pytest.approx((8.0, 0.0, 0.0))


def test_coordinates_count_the_turn(straight_scene: MakeScene, scene_snapshot: See) -> None:
    """Who faces along the road has a longer way, and who is in the strip a negative one."""
    scene = straight_scene(((60.0, -5.15, 0.0),))
    where = Coordinates(scene, 0)
    along, across, within = (
        where(scene_snapshot(scene, testers=[(60.0, y, 1.4, o)]))
        for y, o in ((-5.15, 0.0), (-5.15, math.pi / 2), (-2.0, math.pi / 2))
    )
    assert along is not None
    assert across is not None
    assert within is not None
    assert along.left > across.left + 0.05
    assert along.turn == pytest.approx(math.pi / 2)
    assert within.left < 0.0


def test_no_coordinates_where_no_way_leads_across(straight_scene: MakeScene) -> None:
    """On an open plane there is no road to cross."""
    scene = straight_scene(((60.0, -5.15, 0.0),), open_plane=True)
    assert Coordinates(scene, 0).meeting is None


@BOTH
def test_no_step_of_the_lattice_is_rounded(rules: Rules) -> None:
    """All that an interval moves is a whole number of steps."""
    half = rules.speed_step * rules.interval / 2 / rules.gap_step
    assert half == pytest.approx(rules.advance, abs=1e-9)
    paces = rules.walk_top / (rules.walk_accel * rules.interval)
    assert paces == pytest.approx(rules.paces, abs=1e-9)


@BOTH
def test_the_two_games_agree(rules: Rules) -> None:
    """A goal is sure exactly where the game with priced ends loses less than a miss."""
    inside = sure_region(build(rules, trapped=True)).inside
    lower = solve(build(rules, trapped=False), precision=1e-5).lower
    assert 0.1 < inside.mean() < 0.9
    assert ((lower > -0.9) == inside).all()


@BOTH
def test_forcing_is_monotone(rules: Rules) -> None:
    """More gap, less speed, less to walk and more pace never harm, so corners decide of cells."""
    sure = np.frombuffer(solved(rules).sure, dtype="u1").reshape(rules.shape).astype(int)
    assert (np.diff(sure, axis=0) >= 0).all()
    assert (np.diff(sure, axis=1) <= 0).all()
    assert (np.diff(sure, axis=2) <= 0).all()
    assert (np.diff(sure, axis=3) >= 0).all()


@settings(deadline=None)
@given(st.floats(0.0, 3.0), st.floats(0.01, 1.9), st.floats(0.0, 1.4))
def test_verdicts_against_a_constant_ego(slack: float, left: float, walk: float) -> None:
    """What is said to be sure can be walked in time, what is said to be lost cannot."""
    table, needed = solved(SMALL), time_to_walk(PEDESTRIAN, walk, left)
    if table.surely(slack, 1.0, left, walk):
        assert slack > needed - 1e-6
    if not table.possibly(slack, 1.0, left, walk):
        assert slack < needed + 1e-6


@settings(deadline=None)
@given(
    st.floats(0.1, 30.0), st.floats(2.25, 9.0), st.floats(0.01, 1.4), st.sampled_from([0.0, 0.7])
)
def test_verdicts_against_a_free_ego(gap: float, v: float, left: float, walk: float) -> None:
    """The worst ego accelerates all the time: against it the verdicts can be computed."""
    t = time_to_walk(PEDESTRIAN, walk, left)
    gaining = min(t, (9.0 - v) / 4.5)
    then = v + 4.5 * gaining
    room = gap - (v + then) / 2 * gaining - then * (t - gaining) - then**2 / (2 * B)
    table = solved(FREE)
    if table.surely(gap, v, left, walk):
        assert room > -1e-6
    if not table.possibly(gap, v, left, walk):
        assert room < 1e-6


def test_the_cell_is_what_remains_undecided() -> None:
    """Sure and lost are less than three cells of time apart: the error of the grid."""
    table, step = solved(SMALL), SMALL.gap_step
    for left, walk in ((0.3, 0.0), (1.0, 0.0), (1.0, 1.4), (1.7, 0.7)):
        needed = time_to_walk(PEDESTRIAN, walk, left)
        assert table.surely(needed + 3 * step, 1.0, left, walk)
        assert not table.possibly(needed - 3 * step, 1.0, left, walk)


def test_values_between_the_points() -> None:
    """Interpolated, they are the table's at its points and lie between them elsewhere."""
    table = solved(SMALL)
    gap, left = 4 * SMALL.gap_step, 3 * SMALL.left_step
    _, speeds, lefts, paces = SMALL.shape
    first, second = (table.value[((i * speeds) * lefts + 2) * paces] for i in (3, 4))
    assert table.worth(gap, 1.0, left, 0.0) == first
    middle = table.worth(gap + SMALL.gap_step / 2, 1.0, left, 0.0)
    assert middle == pytest.approx((first + second) / 2)


def forceabilities(kerb: float) -> tuple[ConstantSpeed, Unaware, Free]:
    """One body's view of the three classes."""
    free = Unaware(PEDESTRIAN, solved(FREE), B, 0.02, kerb), Free(PEDESTRIAN, solved(FREE), B, 0.02)
    return ConstantSpeed(PEDESTRIAN, solved(SMALL), B, 0.02), *free


@settings(deadline=None)
@given(st.floats(0.1, 80.0), st.floats(2.3, 8.9), st.floats(0.1, 9.0), st.floats(0.0, 1.4))
def test_the_classes_contain_each_other(gap: float, v: float, left: float, walk: float) -> None:
    """What is sure against any ego is sure against an unaware one and one that keeps its speed."""
    constant, unaware, free = forceabilities(kerb=2.0)
    here = Relative(gap, left, v, walk, 0.0)
    if free.sure(here):
        assert unaware.sure(here)
    if unaware.sure(here):
        assert constant.possible(here)
    for forceability in (constant, unaware, free):
        assert forceability.possible(here) or not forceability.sure(here)


def test_an_ego_that_stands_or_is_too_fast_is_of_no_class() -> None:
    """Nothing is promised against it."""
    constant, unaware, free = forceabilities(kerb=2.0)
    for forceability in (constant, unaware, free):
        assert not forceability.sure(Relative(50.0, 1.0, 0.0, 0.0, 0.0))
    assert not free.sure(Relative(1000.0, 1.0, 9.5, 0.0, 0.0))
    assert constant.sure(Relative(1000.0, 1.0, 9.5, 0.0, 0.0))


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "cavsumo"


def fresh(rules: Rules) -> tuple[bytes, bytes]:
    """A solution as a new process finds it."""
    found: Solved = solved.__wrapped__(rules)
    return bytes(found.sure), bytes(found.value)


def test_a_solution_is_found_again(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is solved once; who comes later reads it and gets the same bytes."""
    first = fresh(SMALL)
    (file,) = cache.iterdir()
    written = file.read_bytes()

    def refuse(_: Rules) -> Any:
        raise AssertionError("solved again")

    with monkeypatch.context() as patched:
        patched.setattr(solutions, "_solve", refuse)
        assert fresh(SMALL) == first
    file.unlink()
    assert fresh(SMALL) == first
    assert file.read_bytes() == written
    assert list(cache.iterdir()) == [file]


@pytest.mark.parametrize("damage", [b"", b"x" * 40, None], ids=["empty", "other", "one byte"])
def test_a_damaged_solution_is_solved_anew(cache: Path, damage: bytes | None) -> None:
    """What is on disk is used only if it is whole."""
    first = fresh(SMALL)
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]) if damage is None else damage)
    assert fresh(SMALL) == first
    assert file.read_bytes() == whole


def test_without_a_place_to_write_it_works_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cache that cannot be made is done without."""
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert fresh(SMALL)[0].count(1) > 0


def test_rules_have_a_key() -> None:
    """Equal rules share a solution, others do not."""
    again = against_constant(PEDESTRIAN, R, 2.0, 0.01, 0.125)
    other = against_constant(PEDESTRIAN, R, 2.0, 0.02, 0.125)
    assert SMALL.key == again.key != other.key
