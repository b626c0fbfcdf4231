"""The kinematics against reference vectors at 400 digits, the literal equations and physics."""

import json
import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from support import DATA

from cavsumo.errors import CavsumoError, NoSuchAction
from cavsumo.model.kinematics import (
    axles,
    centre_of_rotation,
    inverse,
    steering_for_turn,
    step,
    step_floats,
    turn_angle,
    wrap,
)

CASES = json.loads((DATA / "kinematics_vectors.json").read_text())["cases"]
FORWARD = [c for c in CASES if c["kind"] == "forward"]
INVERSE = [c for c in CASES if c["kind"] == "inverse"]
CAR = {"wheelbase": 3.0, "v_min": 0.0, "v_max": 9.0, "dt": 0.1}

lengths = st.floats(0.1, 20.0)
speeds = st.floats(0.0, 50.0)
steps = st.floats(1e-3, 1.0)
headings = st.floats(-math.pi, math.pi, exclude_min=True)
steerings = st.floats(-1.3, 1.3)
places = st.floats(-100.0, 100.0)


def same_angle(a, b, tolerance):
    return abs(math.remainder(a - b, math.tau)) <= tolerance


def ids(cases):
    return [c["id"] for c in cases]


def constants(case):
    c = case["constants"]
    return {"wheelbase": c["b"], "v_min": c["v_min"], "v_max": c["v_max"], "dt": c["lambda"]}


def check_forward(case, successor):
    x, y, v, o = map(float, successor)
    expect = {k: float(value) for k, value in case["expect"].items()}
    start = case["state"]
    scale = max(1.0, abs(start["x"]), abs(start["y"]))
    slack = 8 * math.ulp(scale) if case["id"].startswith("utm") else 1e-12 * scale
    assert abs(x - expect["x"]) <= slack
    assert abs(y - expect["y"]) <= slack
    assert abs(v - expect["v"]) <= math.ulp(expect["v"])
    assert same_angle(o, expect["o"], 1e-12 * max(1.0, abs(expect["theta"])))
    assert -math.pi < o <= math.pi


@pytest.mark.parametrize("case", FORWARD, ids=ids(FORWARD))
def test_step_equals_the_reference(case):
    state = [case["state"][k] for k in "xyvo"]
    check_forward(case, step(state, case["action"]["t"], case["action"]["e"], **constants(case)))
    check_forward(
        case, step_floats(*state, case["action"]["t"], case["action"]["e"], **constants(case))
    )


@pytest.mark.parametrize("case", FORWARD, ids=ids(FORWARD))
def test_turn_angle_equals_the_reference(case):
    theta = turn_angle(
        case["state"]["v"],
        case["action"]["e"],
        wheelbase=case["constants"]["b"],
        dt=case["constants"]["lambda"],
    )
    assert float(theta) == pytest.approx(float(case["expect"]["theta"]), rel=1e-12, abs=0)


@pytest.mark.parametrize("case", INVERSE, ids=ids(INVERSE))
def test_inverse_equals_the_reference(case):
    v, o = case["state"]["v"], case["state"]["o"]
    v1, o1 = case["successor"]["v"], case["successor"]["o"]
    b, dt = case["constants"]["b"], case["constants"]["lambda"]
    if case["expect"]["e"] is None:
        with pytest.raises(NoSuchAction):
            inverse([0, 0, v, o], [0, 0, v1, o1], wheelbase=b, dt=dt)
        with pytest.raises(NoSuchAction):
            steering_for_turn(v, wrap(o1 - o), b, dt)
        return
    tolerance = 1e-8 if case["id"] in ("inv_near_limit", "inv_just_inside") else 1e-12
    t, e = inverse([0, 0, v, o], [0, 0, v1, o1], wheelbase=b, dt=dt)
    assert float(t) == pytest.approx(float(case["expect"]["t"]), rel=1e-12, abs=1e-12)
    assert float(e) == pytest.approx(float(case["expect"]["e"]), rel=0, abs=tolerance)
    assert steering_for_turn(v, wrap(o1 - o), b, dt) == pytest.approx(float(e), rel=1e-15)


@given(speeds.filter(lambda v: v > 0.01), headings, st.floats(-5, 5), steerings, lengths, steps)
def test_inverse_then_step_gives_the_successor(v, o, t, e, b, dt):
    start = [3.0, -4.0, v, o]
    bounds = {"v_min": 0.0, "v_max": 60.0}
    after = step(start, t, e, wheelbase=b, dt=dt, **bounds)
    theta = float(turn_angle(v, e, wheelbase=b, dt=dt))
    if abs(theta) >= math.pi or b * abs(theta) > 2 * v * dt * (1 - 1e-6):
        return  # the principal value is another action, or the edge of the domain is too near
    t1, e1 = inverse(start, after, wheelbase=b, dt=dt)
    again = step(start, t1, e1, wheelbase=b, dt=dt, **bounds)
    # Near the edge an error of theta by one ulp of o (4e-16) moves the centre's course by this.
    room = 1 - (b * theta / (2 * v * dt)) ** 2
    conditioning = 1 + b / (2 * v * dt * math.sqrt(room))
    assert abs(again[2] - after[2]) <= 1e-13 * max(1.0, v)
    assert same_angle(again[3], after[3], 1e-13)
    assert np.hypot(*(again - after)[:2]) <= 1e-13 + 2e-15 * v * dt * conditioning


@given(speeds, headings, steerings, lengths, steps)
def test_inverse_has_a_finite_answer_or_says_there_is_none(v, o, e, b, dt):
    del e
    try:
        t, steering = inverse([0, 0, v, 0.0], [0, 0, v, o], wheelbase=b, dt=dt)
    except NoSuchAction:
        assert v <= 0 or b * abs(o) >= 2 * v * dt
    else:
        assert np.isfinite(t)
        assert abs(steering) < math.pi / 2


@pytest.mark.parametrize("scale", [1e-160, 1e-30, 1.0, 1e30])
def test_inverse_survives_the_very_small_and_the_edge(scale):
    """Just inside the domain the answer is a steering angle, whatever the size of the speed."""
    turn = 0.5
    v = np.nextafter(turn * scale, np.inf)  # b theta just below 2 v dt for b = 2 * scale, dt = 1
    t, e = inverse([0, 0, v, 0], [0, 0, v, turn], wheelbase=2 * scale, dt=1.0)
    assert t == 0.0
    assert 1.5 < e < math.pi / 2


@given(st.integers(3, 60), st.floats(0.05, 1.3), st.booleans(), lengths, headings)
def test_a_full_circle_closes(n, e, right, b, o):
    e = -e if right else e
    circumference = math.tau * (b / 2) / math.sin(math.atan(math.tan(abs(e)) / 2))
    state = np.array([1.0, 2.0, circumference / n, o])
    for _ in range(n):
        state = step(state, 0.0, e, wheelbase=b, v_min=0.0, v_max=1e9, dt=1.0)
    assert state[:2] == pytest.approx([1.0, 2.0], abs=1e-13 * n * max(1.0, circumference))
    assert same_angle(state[3], o, 1e-14 * n)


@given(st.floats(1e-300, 1e-8), st.booleans(), speeds, headings, lengths, steps)
@example(1e-160, False, 9.0, 0.3, 3.0, 0.1)
@example(1e-13, True, 9.0, 0.3, 3.0, 0.1)
def test_small_steering_tends_to_none(e, right, v, o, b, dt):
    """The course changes by beta + theta / 2 = (1/2 + v dt / 2b) e, to first order."""
    bounds = {"wheelbase": b, "v_min": 0.0, "v_max": 60.0, "dt": dt}
    straight = step([1.0, 2.0, v, o], 1.0, 0.0, **bounds)
    turning = step([1.0, 2.0, v, o], 1.0, -e if right else e, **bounds)
    bound = v * dt * 0.5 * e * (1 + v * dt / b) * 1.001
    assert np.hypot(*(turning - straight)[:2]) <= bound + 2e-16 * 4 * (2 + v * dt)
    assert same_angle(turning[3], straight[3], 1.001 * v * dt * e / b + 1e-15)
    assert turning[2] == straight[2]


@given(places, places, speeds, headings)
def test_straight_driving_is_equations_8_to_11(x, y, v, o):
    after = step([x, y, v, o], 0.5, 0.0, wheelbase=3.0, v_min=0.0, v_max=60.0, dt=0.1)
    expected = [x + v * 0.1 * math.cos(o), y + v * 0.1 * math.sin(o), v + 0.5 * 0.1, o]
    assert after[:3] == pytest.approx(expected[:3], rel=1e-14, abs=1e-13)
    assert after[3] == o


def literal_step(x, y, v, o, t, e, b, v_min, v_max, dt):
    """Eqs 6, 7 and 12-19, word by word."""
    rx, ry = x - b / 2 * math.cos(o), y - b / 2 * math.sin(o)
    cx = rx - b / math.tan(e) * math.sin(o)
    cy = ry + b / math.tan(e) * math.cos(o)
    theta = math.copysign(1, e) * 2 * v * dt / math.sqrt(b**2 * (1 + 4 / math.tan(e) ** 2))
    return (
        cx + (x - cx) * math.cos(theta) - (y - cy) * math.sin(theta),
        cy + (x - cx) * math.sin(theta) + (y - cy) * math.cos(theta),
        min(v_max, max(v_min, v + t * dt)),
        math.atan2(math.sin(o + theta), math.cos(o + theta)),
    )


@given(
    places, places, speeds, headings, st.floats(-9, 9), st.floats(0.01, 1.3), st.booleans(), lengths
)
def test_step_equals_the_literal_equations(x, y, v, o, t, e, right, b):
    e = -e if right else e
    after = step([x, y, v, o], t, e, wheelbase=b, v_min=0.0, v_max=40.0, dt=0.1)
    literal = literal_step(x, y, v, o, t, e, b, 0.0, 40.0, 0.1)
    assert after[:3] == pytest.approx(literal[:3], rel=0, abs=1e-9)
    assert same_angle(after[3], literal[3], 1e-9)


@given(speeds, headings, st.floats(0.01, 1.5), st.booleans(), lengths)
def test_equations_14_and_15_agree(v, o, e, right, b):
    """The turn angle is v dt over the distance from the centre of rotation."""
    e = -e if right else e
    state = [7.0, -2.0, v, o]
    centre = centre_of_rotation(state, e, wheelbase=b)
    eq14 = math.copysign(1.0, e) * v * 0.1 / math.dist(centre, state[:2])
    assert float(turn_angle(v, e, wheelbase=b, dt=0.1)) == pytest.approx(eq14, rel=1e-11)


@given(speeds, headings, st.floats(0.05, 1.3), st.booleans(), lengths)
def test_the_centre_keeps_its_distance_from_the_centre_of_rotation(v, o, e, right, b):
    e = -e if right else e
    state = np.array([7.0, -2.0, v, o])
    after = step(state, 0.0, e, wheelbase=b, v_min=0.0, v_max=60.0, dt=0.1)
    centre = centre_of_rotation(state, e, wheelbase=b)
    assert centre_of_rotation(after, e, wheelbase=b) == pytest.approx(centre, abs=1e-10)
    assert math.dist(after[:2], centre) == pytest.approx(math.dist(state[:2], centre), abs=1e-10)


def test_axles_and_centre_of_rotation_by_hand():
    """Facing north with b = 2 and e = 45 degrees the centre of rotation is 2 m to the left."""
    front, rear = axles([10.0, 20.0, 5.0, math.pi / 2], wheelbase=2.0)
    assert front == pytest.approx([10.0, 21.0])
    assert rear == pytest.approx([10.0, 19.0])
    centre = centre_of_rotation([10.0, 20.0, 5.0, math.pi / 2], math.pi / 4, wheelbase=2.0)
    assert centre == pytest.approx([8.0, 19.0])
    centre = centre_of_rotation([10.0, 20.0, 5.0, math.pi / 2], -math.pi / 4, wheelbase=2.0)
    assert centre == pytest.approx([12.0, 19.0])


def test_the_position_uses_the_old_speed():
    """Explicit Euler: a body at rest stays where it is in the step that starts it."""
    assert step([0, 0, 0, 0], 9.0, 0.3, **CAR).tolist() == [0.0, 0.0, 9.0 * 0.1, 0.0]


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_leading_shapes_broadcast(shape):
    rng = np.random.default_rng(7)
    states = np.stack(
        [rng.normal(size=shape), rng.normal(size=shape), rng.random(shape) + 5, rng.random(shape)],
        axis=-1,
    )
    steering = rng.uniform(-0.1, 0.1, shape)
    after = step(states, 0.5, steering, **CAR)
    assert after.shape == (*shape, 4)
    for i in np.ndindex(shape):
        assert after[i] == pytest.approx(step(states[i], 0.5, steering[i], **CAR), rel=1e-14)
    t, e = inverse(states, after, wheelbase=3.0, dt=0.1)
    assert np.shape(t) == np.shape(e) == shape
    assert np.asarray(e) == pytest.approx(steering, abs=1e-12)
    front, rear = axles(states, wheelbase=3.0)
    assert front.shape == rear.shape == (*shape, 2)
    assert centre_of_rotation(states, steering, wheelbase=3.0).shape == (*shape, 2)
    assert np.shape(turn_angle(states[..., 2], steering, wheelbase=3.0, dt=0.1)) == shape


def test_one_state_takes_many_actions():
    after = step([0, 0, 5, 0], [[-1.0], [1.0]], [-0.1, 0.0, 0.1], **CAR)
    assert after.shape == (2, 3, 4)
    assert after[..., 2] == pytest.approx(np.array([[4.9] * 3, [5.1] * 3]))
    assert after[0, 0, 1] == -after[0, 2, 1] < 0


@given(places, places, speeds, headings, st.floats(-9, 9), steerings, lengths, steps)
@example(0.0, 0.0, 1.75, 0.0, 0.0, 2.225073858507e-311, 1.0, 1.0)
def test_floats_and_arrays_agree(x, y, v, o, t, e, b, dt):
    array = step([x, y, v, o], t, e, wheelbase=b, v_min=1.0, v_max=40.0, dt=dt)
    floats = step_floats(x, y, v, o, t, e, b, 1.0, 40.0, dt)
    theta = abs(float(turn_angle(v, e, wheelbase=b, dt=dt)))
    # An angle of theta carries a rounding error of theta ulps, and a position one of itself.
    scale = max(1.0, abs(x), abs(y), v * dt * max(1.0, theta))
    assert array[:2] == pytest.approx(floats[:2], rel=0, abs=1e-15 * scale)
    assert array[2] == floats[2]
    assert same_angle(array[3], floats[3], 1e-15 * max(1.0, theta))


@given(speeds.filter(lambda v: v > 0.1), st.floats(-3.0, 3.0), lengths)
def test_float_and_array_steering_agree(v, turn, b):
    try:
        steering = steering_for_turn(v, turn, b, 0.1)
    except NoSuchAction:
        with pytest.raises(NoSuchAction):
            inverse([0, 0, v, 0], [0, 0, v, turn], wheelbase=b, dt=0.1)
        return
    _, e = inverse([0, 0, v, 0], [0, 0, v, turn], wheelbase=b, dt=0.1)
    assert float(e) == pytest.approx(steering, rel=1e-15, abs=0)


@given(st.floats(-1e3, 1e3))
@example(math.pi)
@example(-math.pi)
@example(3 * math.pi)
@example(-3 * math.pi)
def test_orientations_stay_in_their_range(angle):
    wrapped = wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert same_angle(wrapped, angle, 1e-12)
    after = step([0, 0, 0, angle], 0.0, 0.0, **CAR)
    assert after[3] == wrapped


def test_minus_pi_becomes_pi():
    assert wrap(-math.pi) == math.pi
    assert wrap(math.pi) == math.pi
    assert step([0, 0, 1, -math.pi], 0.0, 0.0, **CAR)[3] == math.pi
    assert step_floats(0, 0, 1, -math.pi, 0.0, 0.0, 3.0, 0.0, 9.0, 0.1)[3] == math.pi


BAD_STEPS = {
    "state": {"state": [0, 0, math.nan, 0]},
    "state .*shape": {"state": [0, 0, 0]},
    "throttle": {"throttle": math.inf},
    "steering must be finite": {"steering": math.nan},
    r"\|steering\|": {"steering": math.pi / 2},
    "wheelbase": {"wheelbase": 0.0},
    "wheelbase must be positive and finite": {"wheelbase": math.nan},
    "dt": {"dt": 0.0},
    "v_min": {"v_min": 3.0, "v_max": 2.0},
    "0 <= v_min": {"v_min": -1.0},
    "v_max": {"v_max": math.nan},
}


@pytest.mark.parametrize("message", BAD_STEPS)
def test_step_names_the_bad_argument(message):
    good = {"state": [0, 0, 5, 0], "throttle": 0.0, "steering": 0.0, **CAR}
    with pytest.raises(ValueError, match=message):
        step(**(good | BAD_STEPS[message]))


def test_inverse_counts_the_elements_without_an_action():
    state = np.zeros((2, 3, 4))
    state[..., 2] = 5.0
    after = state.copy()
    state[0, 1, 2] = 0.0
    after[1, 2, 3] = 2.0
    with pytest.raises(NoSuchAction, match=r"2 of 6 .*\(0, 1\)"):
        inverse(state, after, wheelbase=3.0, dt=0.1)
    with pytest.raises(ValueError, match="successor"):
        inverse(state, np.full((2, 3, 4), np.nan), wheelbase=3.0, dt=0.1)


@pytest.mark.parametrize(
    ("v", "turn"), [(0.0, 0.0), (-1.0, 0.1), (9.0, 0.7), (math.nan, 0.0), (9.0, math.nan)]
)
def test_steering_for_turn_never_gives_nan(v, turn):
    with pytest.raises(NoSuchAction):
        steering_for_turn(v, turn, 3.0, 0.1)


@pytest.mark.parametrize("steering", [0.0, -0.0, 1e-320, [0.1, 0.0]])
def test_a_straight_path_has_no_centre(steering):
    with pytest.raises(ValueError, match="centre of rotation") as raised:
        centre_of_rotation([0, 0, 1, 0], steering, wheelbase=3.0)
    assert not isinstance(raised.value, CavsumoError)


EXTREMES = [0.0, 5e-324, 1e-300, 1.0, 1e155, 1e300, 1.7e308]


@pytest.mark.parametrize("v", EXTREMES)
@pytest.mark.parametrize("place", [*EXTREMES, -1.7e308])
def test_no_step_has_a_result_that_is_not_finite(v, place):
    """Whatever finite numbers: a finite answer, or ValueError; the array and the floats alike."""
    cases = ((dt, e, t) for dt in (1e-300, 0.1, 10.0, 1.7e308) for e in (0.0, 0.6, -1.5)
             for t in (0.0, -1.7e308, 1.7e308))  # fmt: skip
    for dt, e, t in cases:
        constants = {"wheelbase": 3.0, "v_min": 0.0, "v_max": 9.0, "dt": dt}
        answers = []
        for one in (lambda s, t, e, **c: step(s, t, e, **c),
                    lambda s, t, e, **c: step_floats(*s, t, e, **c)):  # fmt: skip
            try:
                answers.append(np.array(one((place, -place, v, 1.0), t, e, **constants)))
            except ValueError:
                answers.append(None)
        assert all(a is None or np.isfinite(a).all() for a in answers)
        assert (answers[0] is None) == (answers[1] is None), (dt, e, t)


def test_a_way_beyond_the_range_of_floats_is_refused():
    """1e308 m/s for 10 s, straight on and on a circle."""
    for e in (0.0, 0.3):
        with pytest.raises(ValueError, match="must be finite"):
            step((0.0, 0.0, 1e308, 0.0), 0.0, e, wheelbase=3.0, v_min=0.0, v_max=1e308, dt=10.0)
        with pytest.raises(ValueError, match="must be finite" if not e else "domain"):
            step_floats(0.0, 0.0, 1e308, 0.0, 0.0, e, 3.0, 0.0, 1e308, 10.0)
    with pytest.raises(ValueError, match="turn angle must be finite"):
        turn_angle(1e308, 0.3, wheelbase=3.0, dt=10.0)
