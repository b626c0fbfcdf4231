"""Formulas: what they mean, in numbers computed by hand and against another evaluator."""

from __future__ import annotations

import json
import math
import operator
import random
import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from support import DATA, ROOT

from cavsumo.assertions.formula import FormulaAssertion
from cavsumo.assertions.formulas import SIGNALS, Moment, View, robustness, rule
from cavsumo.assertions.formulas.nodes import (
    Comparison,
    Conditional,
    Connective,
    Constant,
    Interval,
    Not,
    Number,
    Signal,
    Temporal,
    TruthNode,
    Until,
)
from cavsumo.assertions.formulas.semantics import TINY, Bounds
from cavsumo.assertions.formulas.windows import largest_ahead
from cavsumo.assertions.metrics import drac_boxes, ttc_boxes
from cavsumo.errors import AssertionFault, InputError, UnknownName
from cavsumo.model.bodies import CAR, PEDESTRIAN, Body
from cavsumo.model.carriageway import Light, Start
from cavsumo.model.polyline import Path as Polyline
from cavsumo.model.scene import Scene
from cavsumo.model.snapshot import BodyState, Snapshot

VECTORS = DATA / "formula_vectors.json"
CASES = json.loads(VECTORS.read_text(encoding="utf-8"))["cases"]
WORDS = {"inf": math.inf, "tiny": TINY, "-tiny": -TINY}
COMPARE: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}

Trace = dict[str, list[float]]


def view(trace: Trace, dt: float = 1.0, closed: bool = True) -> View:
    """A trace as the semantics takes it."""
    n = len(next(iter(trace.values()), []))
    return View({name: np.array(values, float) for name, values in trace.items()}, n, dt, closed)


# Vectors ------------------------------------------------------------------------------------------


def judged(text: str, trace: Trace, dt: float, monkeypatch: pytest.MonkeyPatch) -> FormulaAssertion:
    """An assertion after an episode in which its signals are these."""
    assertion = FormulaAssertion(rule("f", text, dt))
    for name, values in trace.items():
        kind = SIGNALS[name]
        shown = type(kind)(kind.unit, kind.meaning, partial(_at_step, values))
        monkeypatch.setitem(SIGNALS, name, shown)  # type: ignore[arg-type]
    ego = Body("ego", CAR)
    assertion.reset(Scene(dt, ego, Polyline([(0, 0), (100, 0)]), (), ()))
    for step in range(len(next(iter(trace.values())))):
        assertion.observe(Snapshot(step, step * dt, BodyState(ego, 0, 0, 0, 0), 0, ()), ())
    assertion.conclude()
    return assertion


def _at_step(values: list[float], moment: Moment) -> float:
    return values[moment.now.step]


@pytest.mark.parametrize("case", CASES, ids=[c["formula"] for c in CASES])
def test_vectors(case: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Robustness and verdict with their times are those computed by hand."""
    dt, own = case["dt"], rule("f", case["formula"], case["dt"])
    expected = WORDS.get(case["robustness"], case["robustness"])
    whole = float(robustness(own.whole, view(case["trace"], dt)).greatest[0])
    said = judged(case["formula"], case["trace"], dt, monkeypatch).judgement
    steps = [t if t is None else round(t / dt) for t in (said.trigger_time, said.violation_time)]
    assert said.verdict == case["verdict"]
    assert steps == [case["triggered"], case["violated"]]
    if said.triggered:
        assert said.robustness == expected
        assert (said.verdict == "violated") == (expected < 0.0)
    else:
        assert said.robustness is None
        assert whole == expected


# Against a Boolean evaluator ----------------------------------------------------------------------


def truth(node: TruthNode, trace: Trace, i: int, n: int, closed: bool) -> bool | None:
    """What a formula says at timestep i, None if that depends on what follows; written apart.

    Timesteps from n on are unknown. Nothing here is fast.
    """
    at = partial(truth, trace=trace, n=n, closed=closed)
    if i >= n:
        return node.value if isinstance(node, Constant) else None
    match node:
        case Constant(value=value):
            return value
        case Comparison(op=op, left=Signal(name=name), right=Number(value=bound)):
            return bool(COMPARE[op](trace[name][i], bound))
        case Not(of=of):
            return _not(at(of, i=i))
        case Connective(op="and", of=parts):
            return _all(at(part, i=i) for part in parts)
        case Connective(of=parts):
            return _not(_all(_not(at(part, i=i)) for part in parts))
        case Conditional(left=left, right=right, both=both):
            p, q = at(left, i=i), at(right, i=i)
            if both:
                return None if p is None or q is None else p == q
            return _any((_not(p), q))
        case Temporal(op="next", of=of):
            return at(of, i=i + 1)
        case Temporal(op="once" | "historically" as op, within=within, of=of):
            when = [j for j in range(n) if within.begin <= i - j <= within.end]
            return (_any if op == "once" else _all)(at(of, i=j) for j in when)
        case Temporal(op=op, within=within, of=of):
            parts = [at(of, i=j) for j in _window(i, within, n, closed)]
            return _any(parts) if op == "eventually" else _all(parts)
        case Until(left=left, right=right, within=within, past=True):
            when = [j for j in range(n) if within.begin <= i - j <= within.end]
            return _any(
                _all([at(right, i=j), *(at(left, i=k) for k in range(j + 1, i + 1))]) for j in when
            )
        case Until(left=left, right=right, within=within):
            return _any(
                _all([at(right, i=j), *(at(left, i=k) for k in range(i, j))])
                for j in _window(i, within, n, closed)
            )
    raise AssertionError(node)


def _window(i: int, within: Interval, n: int, closed: bool) -> range:
    """The timesteps that an operator sees; one unknown behind the end stands for all of them."""
    begin = i + int(within.begin)
    if math.isinf(within.end):
        return range(begin, n if closed else max(begin, n) + 1)
    return range(begin, i + int(within.end) + 1)


def _not(p: bool | None) -> bool | None:
    return None if p is None else not p


def _all(parts: Any) -> bool | None:
    found = list(parts)
    return False if False in found else None if None in found else True


def _any(parts: Any) -> bool | None:
    return _not(_all(_not(p) for p in parts))


def random_formula(rng: random.Random, depth: int) -> TruthNode:
    """A formula over x and y, compared with small whole numbers, so that bounds are met."""
    below = partial(random_formula, rng, depth - 1)
    begin = rng.randrange(3)
    end = math.inf if rng.random() < 0.4 else begin + rng.randrange(4)
    within = Interval(float(begin), float(end))
    sort = rng.randrange(11) if depth else 0
    if sort <= 1:
        bound = Number(float(rng.randrange(-2, 3)), 0)
        op = rng.choice(["<", "<=", ">", ">=", "==", "!="])
        return Comparison(op, Signal(rng.choice("xy"), 0), bound, 0)
    if sort == 2:
        return Not(below(), 0)
    if sort == 3:
        return Connective(
            rng.choice(["and", "or"]), (below(), below(), below())[: 2 + begin % 2], 0
        )
    if sort == 4:
        return Conditional(below(), below(), rng.random() < 0.3, 0)
    if sort == 5:
        return Temporal("next", Interval(), below(), 0)
    if sort in (6, 7):
        return Until(below(), below(), within, sort == 7, 0)
    ops = ["always", "eventually", "historically", "once"]
    return Temporal(rng.choice(ops), within, below(), 0)


def random_pairs(count: int, seed: int) -> Iterator[tuple[TruthNode, Trace]]:
    """Formulas with traces of 1 to 9 timesteps."""
    rng = random.Random(seed)
    for _ in range(count):
        n = rng.randrange(1, 10)
        yield (
            random_formula(rng, rng.randrange(4)),
            {name: [float(rng.randrange(-3, 4)) for _ in range(n)] for name in "xy"},
        )


@pytest.mark.parametrize(("closed", "pairs"), [(True, 10_000), (False, 3000)])
def test_the_sign_is_the_verdict(closed: bool, pairs: int) -> None:
    """On 10,000 pairs the sign of the robustness says what a Boolean evaluator says."""
    found = {True: 0, False: 0, None: 0}
    for formula, trace in random_pairs(pairs, seed=int(closed)):
        least, greatest = (float(x[0]) for x in robustness(formula, view(trace, closed=closed)))
        expected = truth(formula, trace, 0, len(trace["x"]), closed)
        said = True if least > 0.0 else False if greatest < 0.0 else None
        assert said is expected, f"{formula}\n{trace}"
        assert least <= greatest
        assert 0.0 not in (least, greatest)
        found[expected] += 1
    assert min(found.values()) > pairs / 50  # every answer was given often


def test_more_of_a_trace_says_more() -> None:
    """As a trace goes on its interval shrinks, and the end of the episode shrinks it once more."""
    for formula, trace in random_pairs(300, seed=3):
        n = len(trace["x"])
        before = Bounds(*np.array([[-math.inf], [math.inf]]))
        for k in range(1, n + 1):
            cut = {name: values[:k] for name, values in trace.items()}
            now = robustness(formula, view(cut, closed=False))
            over = robustness(formula, view(cut, closed=True))
            assert before.least[0] <= now.least[0] <= over.least[0], formula
            assert over.greatest[0] <= now.greatest[0] <= before.greatest[0], formula
            before = now


def test_better_margins_never_make_a_formula_worse() -> None:
    """Without negation, to raise a signal that must be large never lowers the robustness."""
    rng = random.Random(4)
    for _ in range(500):
        formula = _positive(rng, 3)
        n = rng.randrange(1, 9)
        low = [rng.uniform(-3, 3) for _ in range(n)]
        high = [x + rng.choice([0.0, rng.uniform(0, 2)]) for x in low]
        for closed in (True, False):
            a, b = (robustness(formula, view({"x": x}, closed=closed)) for x in (low, high))
            assert (a.least <= b.least).all()
            assert (a.greatest <= b.greatest).all()


def _positive(rng: random.Random, depth: int) -> TruthNode:
    """A formula that only asks x to be large."""
    within = Interval(0.0, float(rng.randrange(4)))
    if depth == 0 or rng.random() < 0.2:
        op, bound = rng.choice([">", ">="]), Number(rng.uniform(-1, 1), 0)
        return Comparison(op, Signal("x", 0), bound, 0)
    parts = _positive(rng, depth - 1), _positive(rng, depth - 1)
    if rng.random() < 0.3:
        return Connective(rng.choice(["and", "or"]), parts, 0)
    if rng.random() < 0.4:
        return Until(*parts, within, rng.random() < 0.5, 0)
    return Temporal(
        rng.choice(["always", "eventually", "once", "historically"]), within, parts[0], 0
    )


def test_dualities() -> None:
    """not always is eventually not, not historically is once not; since mirrors until."""
    for formula, trace in random_pairs(200, seed=5):
        for one, other in (("always", "eventually"), ("historically", "once")):
            within = Interval(1.0, 3.0)
            a = Not(Temporal(one, within, formula, 0), 0)
            b = Temporal(other, within, Not(formula, 0), 0)
            for closed in (True, False):
                shown = view(trace, closed=closed)
                for x, y in zip(robustness(a, shown), robustness(b, shown), strict=True):
                    assert np.array_equal(x, y)


@pytest.mark.parametrize("n", [1, 2, 7, 50])
def test_windows_against_brute_force(n: int) -> None:
    """The sliding maximum is the maximum of each window."""
    x = np.random.default_rng(n).normal(size=n)
    for begin in range(n + 2):
        for end in (*range(begin, n + 3), None):
            last = n if end is None else end
            expected = [max(x[i + begin : i + last + 1], default=-math.inf) for i in range(n)]
            assert largest_ahead(x, begin, end).tolist() == expected


@pytest.mark.parametrize("text", ["always (gap_m > 1)", "gap_m < 2 => speed_mps < 1 or gap_m > 1"])
def test_timestep_by_timestep_is_the_whole(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A rule judged at each timestep says what its whole formula says of the same trace."""
    rng = random.Random(text)
    for _ in range(50):
        trace = {name: [rng.uniform(0.9, 5) for _ in range(9)] for name in ("gap_m", "speed_mps")}
        trace = {name: trace[name] for name in rule("f", text, 0.5).signals}
        said = judged(text, trace, 0.5, monkeypatch).judgement
        whole = float(robustness(rule("f", text, 0.5).whole, view(trace, 0.5)).greatest[0])
        assert (said.verdict == "violated") == (whole < 0.0)
        if said.verdict == "held":
            assert said.robustness == whole


def test_what_is_asked_within_a_time_keeps_the_episode_going(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A rule is pending while what it asks may still come, and when that is over it is not."""
    trace: Trace = {"ttc_s": [9, 9, 1, 9, 9, 9, 9], "speed_mps": [8, 8, 8, 8, 8, 0.5, 8]}
    text, seen = "ttc_s < 2 => eventually[0,3] speed_mps < 1", []
    observe = FormulaAssertion.observe

    def noting(self: FormulaAssertion, *shown: Any) -> None:
        observe(self, *shown)
        seen.append(self.pending)

    monkeypatch.setattr(FormulaAssertion, "observe", noting)
    judged(text, trace, 1.0, monkeypatch)
    assert seen == [False, False, True, True, True, False, False]


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gap_m >", "column 8: expected a signal, a number or '(', got the end"),
        ("gap_m > 1 2", "column 11: expected an operator or the end, got '2'"),
        ("1 < gap_m < 2", "column 11: expected 'and' between two comparisons, got '<'"),
        ("gap_m = 1", "column 7: got '=', equality is written '=='"),
        ("always (gap_m)", "column 8: expected something true or false"),
        ("(gap_m > 1) + 1 > 2", "column 1: expected a number, got something true or false"),
        ("gap_m > 1 + (gap_m > 1)", "column 13: expected a number, got something true"),
        ("(gap_m > 1", "column 11: expected ')', got the end"),
        ("F[5,2] gap_m > 1", "column 2: the interval ends at 2 s, before 5 s"),
        ("F[-1,2] gap_m > 1", "column 3: expected a number of seconds, not negative, got '-'"),
        ("F[0.01,0.05] gap_m > 1", "column 2: no timestep of 0.1 s lies in [0.01, 0.05] s"),
        ("min(gap_m) > 2", "column 1: min takes two or more numbers, got 1"),
        ("gap_m > 1e999", "column 9: 1e999 is too large"),
        ("gap_m > 1 ;", "column 11: no formula has ';'"),
        ("2gap_m > 1", "column 1: expected a number or a name, got '2gap_m'"),
        ("true until true until true", "column 17: 'until' after another needs parentheses"),
        ("true\nand\n not", "line 3, column 5: expected a signal, a number or '(', got the end"),
        ("", "column 1: expected a signal"),
        ("(" * 1000, "column 502: longer than 500 words"),
        ("(" * 100, "column 42: more than 40 levels within each other"),
        ("not " * 100 + "true", "more than 40 levels within each other"),
        ("true => " * 100 + "true", "more than 40 levels within each other"),
    ],
)
def test_mistakes_are_pointed_at(text: str, said: str) -> None:
    """One sentence with the column, what was expected and what was there."""
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        rule("f", text, 0.1)
    assert str(caught.value).startswith("formula f: ")
    assert "\n" not in str(caught.value)


def test_an_unknown_signal_suggests_the_nearest() -> None:
    """With its column."""
    with pytest.raises(UnknownName, match=r"column 9: unknown signal 'gapm'; did you mean 'gap_m'"):
        rule("f", "always (gapm > 1)", 0.1)


def test_long_formulas_are_read_and_judged() -> None:
    """As long as a formula may be, however it is grouped."""
    for text in ("+".join(["speed_mps"] * 240) + " > 1", " and ".join(["speed_mps > 1"] * 120)):
        own = rule("f", text, 0.1)
        assert robustness(own.whole, view({"speed_mps": [2.0]})).least[0] > 0.0


def test_what_has_no_value_is_an_error_with_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """0 / 0 is no number; x / 0 is infinite."""
    trace: Trace = {"gap_m": [1, 1, 0], "speed_mps": [1, 0, 0]}
    with pytest.raises(AssertionFault, match=r"formula f: column 7: .* no number .* at 2\.00 s"):
        judged("gap_m / speed_mps > 0", trace, 1.0, monkeypatch)


# Signals ------------------------------------------------------------------------------------------


def test_signals_are_documented() -> None:
    """The table of docs/formulas.md is the code's."""
    text = (ROOT / "docs" / "formulas.md").read_text(encoding="utf-8")
    rows = [tuple(c.strip() for c in row) for row in re.findall(r"\| `(\w+)` \|(.*)\|(.*)\|", text)]
    assert rows == [(name, s.unit, s.meaning) for name, s in SIGNALS.items()]


def moment(**changes: Any) -> Moment:
    """An ego at (20, 1) heading east at 8 m/s, that was 1 m/s faster; testers and others."""
    ego, car = Body("ego", CAR), CAR.length / 2
    person, other = Body("tester0", PEDESTRIAN), Body("other", CAR)
    testers = (
        BodyState(person, 40.0, 1.0, 1.5, math.pi / 2),
        BodyState(person._replace(id="tester1"), 20.0 - car - 3.0, 1.0, 0.5, math.pi / 2),
    )
    scene = Scene(
        0.5,
        ego,
        Polyline([(0, 0), (100, 0)]),
        tuple(t.body for t in testers),
        tuple(Start(t.x, t.y, t.o) for t in testers),
        None,
        (Light("a", 0, 22.0), Light("b", 0, 60.0)),
    )
    background = ((other, 20.0, 4.0, 8.0, 0.0),)
    state = BodyState(ego, 20.0, 1.0, 8.0, 0.0)
    now = Snapshot(4, 2.0, state, 0.1, testers, background, ("G", "r"))
    return Moment(scene, now._replace(ego=state._replace(v=9.0)), now._replace(**changes))


def test_signals_by_hand() -> None:
    """A moment whose signals can be told without a computer, but for the collision times."""
    now = {name: kind.value(moment()) for name, kind in SIGNALS.items()}
    ego, first, _ = moment().now.ego, *moment().now.testers
    velocity = (first.v * math.cos(first.o), first.v * math.sin(first.o))
    assert now == pytest.approx(
        {
            "time_s": 2.0,
            "speed_mps": 8.0,
            "acceleration_mps2": -2.0,
            "steering_rad": 0.1,
            "along_m": 20.0,
            "lateral_m": 1.0,
            "gap_m": 3.0 - PEDESTRIAN.width / 2,
            "gap_all_m": 3.0 - CAR.width,
            "ttc_s": float(ttc_boxes(ego.box, (8.0, 0.0), first.box, velocity)),
            "ttc_all_s": float(ttc_boxes(ego.box, (8.0, 0.0), first.box, velocity)),
            "drac_mps2": float(drac_boxes(ego.box, (8.0, 0.0), first.box, velocity)),
            "drac_all_mps2": float(drac_boxes(ego.box, (8.0, 0.0), first.box, velocity)),
            "nearest_speed_mps": 0.5,
            "testers_on_road": 0.0,
            "contact": 0.0,
            "contact_all": 0.0,
            "light": -1.0,  # its front is beyond the first stop line
            "light_distance_m": 40.0 - CAR.length / 2,
        }
    )


def test_signals_with_nobody_there() -> None:
    """Nobody is infinitely far away."""
    empty = moment(testers=(), raw_background=(), lights=())
    now = {name: kind.value(empty) for name, kind in SIGNALS.items()}
    far = ("gap_m", "gap_all_m", "ttc_s", "ttc_all_s", "light_distance_m")
    assert {now[name] for name in far} == {math.inf}
    assert (now["drac_mps2"], now["nearest_speed_mps"], now["contact"], now["light"]) == (
        0,
        0,
        0,
        1,
    )


def test_signals_touching() -> None:
    """Who touches the ego is at no distance."""
    here = moment().now.testers[0]._replace(x=20.0)
    now = {name: kind.value(moment(testers=(here,))) for name, kind in SIGNALS.items()}
    assert (now["gap_m"], now["ttc_s"], now["contact"], now["contact_all"]) == (0, 0, 1, 1)
