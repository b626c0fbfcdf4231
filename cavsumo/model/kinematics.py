"""Body kinematics of the seed: the bicycle model with an explicit Euler position (eqs 4-22).

"The seed" is the draft paper "Simulator-Based Verification of Autonomous Vehicles: Agent-Based
Test Generation"; equation numbers are those of its appendix. A state is (x, y, v, o): position of
the body's centre [m], speed [m/s] and orientation [rad], anticlockwise from east, in (-pi, pi]. An
action is (throttle, steering): acceleration [m/s^2] and steering angle [rad], positive to the left.

The seed has one branch for steering e = 0 (eqs 8-11) and one that divides by tan e (eqs 12-19); in
float64 the second is wrong by about 5e-16 * wheelbase / |e| metres. This module uses one equivalent
form for both, which has no branch and no such division. With wheelbase b and time step dt:

    beta  = atan(tan(e) / 2)                 direction of motion relative to the orientation
    theta = (2 v dt / b) sin(beta)           turn angle, eq. 15 with the sign of e included
    s     = v dt sin(theta / 2) / (theta/2)  chord of the arc (v dt for theta = 0)
    x', y' = (x, y) + s (cos, sin)(o + beta + theta / 2)
    v'    = min(v_max, max(v_min, v + t dt))
    o'    = o + theta, brought back into (-pi, pi]

It holds because the centre moves on a circle of radius (b / 2) / sin(beta): a chord lies half the
turn angle off the tangent, and the tangent is o + beta. The position uses the old speed v.

The array functions check their input. `step_floats` and `steering_for_turn` serve one body in an
inner loop, where NumPy costs ten times more: tests/unit/test_kinematics.py compares the copies.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cavsumo.errors import NoSuchAction
from cavsumo.model.geometry import wrap as wrap

FloatArray = NDArray[np.float64]


def step(
    state: ArrayLike,
    throttle: ArrayLike,
    steering: ArrayLike,
    *,
    wheelbase: float,
    v_min: float,
    v_max: float,
    dt: float,
) -> FloatArray:
    """Return the successor of `state` under one action (seed, eqs 8-19; form: see the module).

    Args:
        state: (x, y, v, o), shape [..., 4]; units m, m, m/s, rad.
        throttle: t [m/s^2], shape [...]; the leading shapes of all three broadcast.
        steering: e [rad], shape [...], |e| < pi/2.
        wheelbase: b [m], > 0. The seed allows b = 0, where eq. 15 has no limit unless e = 0.
        v_min, v_max: speed bounds [m/s], 0 <= v_min <= v_max.
        dt: time step lambda [s], > 0.

    Returns:
        The successor (x', y', v', o'), shape [..., 4]; always finite.

    Raises:
        ValueError: an argument or the result is not finite or outside its range; unfit shapes.
    """
    x, y, v, o = _columns("state", state)
    t = _finite("throttle", throttle)
    if not 0.0 <= v_min <= v_max < math.inf:
        raise ValueError(f"need 0 <= v_min <= v_max < inf, got v_min={v_min}, v_max={v_max}")
    beta, theta = _angles(v, steering, wheelbase, dt)
    half, round_ = 0.5 * theta, _wrap(o + theta)
    # sin(half)/half without 0/0; the divisor 1 is never used where half is 0.
    with np.errstate(over="ignore", invalid="ignore"):
        chord = v * dt * np.where(half == 0.0, 1.0, np.sin(half) / np.where(half == 0.0, 1.0, half))
        course = o + beta + half
        v_next = np.minimum(v_max, np.maximum(v_min, v + t * dt))
        successor = (x + chord * np.cos(course), y + chord * np.sin(course), v_next, round_)
    return _finite("successor", np.stack(np.broadcast_arrays(*successor), axis=-1))


def inverse(
    state: ArrayLike, successor: ArrayLike, *, wheelbase: float, dt: float
) -> tuple[FloatArray, FloatArray]:
    """Return the action (throttle, steering) that leads from `state` to `successor`.

    Seed, eqs 20-22, with theta = o' - o brought into (-pi, pi]:

        t = (v' - v) / dt
        e = atan2(2 b theta, sqrt((2 v dt - b |theta|) (2 v dt + b |theta|)))

    The positions are ignored. The action is one of several if the step clamped the speed (t is then
    the smallest in size) or turned the body by more than pi (theta is then the principal value).
    The bounds of a particular body on throttle and steering are the caller's to check.

    Args:
        state: (x, y, v, o), shape [..., 4]; units m, m, m/s, rad.
        successor: likewise; the leading shapes broadcast.
        wheelbase, dt: b [m] and time step [s], as in `step`.

    Returns:
        t [m/s^2] and e [rad], each of the leading shape; never NaN.

    Raises:
        NoSuchAction: v <= 0 or b |theta| >= 2 v dt in any element of the batch.
        ValueError: an argument is not finite or outside its range, or shapes do not fit.
    """
    _, _, v, o = _columns("state", state)
    _, _, v_next, o_next = _columns("successor", successor)
    _positive(wheelbase=wheelbase, dt=dt)
    v, v_next, theta = np.broadcast_arrays(v, v_next, _wrap(o_next - o))
    twice, arc = 2.0 * v * dt, wheelbase * np.abs(theta)
    _require_action((v > 0.0) & (arc < twice), theta)
    # Factored, so nothing cancels at the edge of the domain; two roots, so nothing underflows.
    root = np.sqrt(twice - arc) * np.sqrt(twice + arc)
    return (v_next - v) / dt, np.arctan2(2.0 * wheelbase * theta, root)


def turn_angle(v: ArrayLike, steering: ArrayLike, *, wheelbase: float, dt: float) -> FloatArray:
    """Return the turn angle theta = (2 v dt / b) sin(atan(tan(e) / 2)) in rad (seed, eq. 15).

    Args:
        v: speed [m/s], shape [...]; steering: e [rad], |e| < pi/2; broadcasts with v.
        wheelbase, dt: b [m] and time step [s], as in `step`.

    Returns:
        theta [rad], positive to the left, not wrapped, of the broadcast shape.

    Raises:
        ValueError: an argument, or the turn angle, is not finite or outside its range.
    """
    return _angles(_finite("v", v), steering, wheelbase, dt)[1]


def axles(state: ArrayLike, *, wheelbase: float) -> tuple[FloatArray, FloatArray]:
    """Return the positions of the front and rear wheels (seed, eqs 4-7).

        front = (x, y) + (b / 2) (cos o, sin o),  rear = (x, y) - (b / 2) (cos o, sin o)

    Args:
        state: (x, y, v, o), shape [..., 4], as in `step`; wheelbase: b [m], > 0.

    Returns:
        front and rear [m], each of shape [..., 2].

    Raises:
        ValueError: an argument is not finite or outside its range.
    """
    x, y, _, o = _columns("state", state)
    _positive(wheelbase=wheelbase)
    arm = 0.5 * wheelbase * np.stack((np.cos(o), np.sin(o)), axis=-1)
    return np.stack((x, y), axis=-1) + arm, np.stack((x, y), axis=-1) - arm


def centre_of_rotation(state: ArrayLike, steering: ArrayLike, *, wheelbase: float) -> FloatArray:
    """Return the point about which the body turns (seed, eqs 12-13).

        c = rear + (b / tan e) (-sin o, cos o)

    Args:
        state: (x, y, v, o), shape [..., 4], as in `step`; wheelbase: b [m], > 0.
        steering: e [rad], 0 < |e| < pi/2; broadcasts with the leading shape.

    Returns:
        c [m], shape [..., 2].

    Raises:
        ValueError: some steering is 0, or so small that the point is beyond the float range (a
            straight path has no centre); or an argument is not finite or outside its range.
    """
    e = _steering(steering)
    _, rear = axles(state, wheelbase=wheelbase)
    o = _columns("state", state)[3]
    with np.errstate(divide="ignore", over="ignore"):
        radius = wheelbase / np.tan(e)
    if not np.isfinite(radius).all():
        raise ValueError("steering must not be 0: a straight path has no centre of rotation")
    centre: FloatArray = rear + radius[..., None] * np.stack((-np.sin(o), np.cos(o)), axis=-1)
    return centre


def step_floats(
    x: float,
    y: float,
    v: float,
    o: float,
    throttle: float,
    steering: float,
    wheelbase: float,
    v_min: float,
    v_max: float,
    dt: float,
) -> tuple[float, float, float, float]:
    """Return (x', y', v', o') for one body: `step` on plain floats, without checks.

    Arguments, units and equations are those of `step`. ValueError if the result is not finite.
    """
    beta, half, chord = 0.0, 0.0, v * dt
    if steering:  # only to save time: without steering the formula gives just this
        beta = math.atan(0.5 * math.tan(steering))
        half = v * dt * math.sin(beta) / wheelbase
        chord = v * dt * (math.sin(half) / half) if half else v * dt
    course = o + beta + half
    v_next = v + throttle * dt
    # Comparisons, since calls (min, max, isfinite) cost a quarter of the step.
    v_next = v_min if v_next < v_min else v_next
    v_next = v_max if v_next > v_max else v_next
    o_next = o + 2.0 * half
    if not -math.pi < o_next <= math.pi:
        o_next = wrap(o_next)
    x_next, y_next = x + chord * math.cos(course), y + chord * math.sin(course)
    if (x_next - x_next) + (y_next - y_next):  # NaN, unless both are finite
        raise ValueError(f"the way of a body at v={v} m/s in {dt} s must be finite")
    return x_next, y_next, v_next, o_next


def steering_for_turn(v: float, turn: float, wheelbase: float, dt: float) -> float:
    """Return the steering e [rad] that turns one body by `turn` in one step (seed, eq. 22).

    The formula is that of `inverse`, on plain floats.

    Args:
        v: speed [m/s]; turn: theta [rad], not wrapped here; wheelbase: b [m]; dt: time step [s].

    Raises:
        NoSuchAction: unless v > 0 and b |theta| < 2 v dt; hence also for NaN. Never returns NaN.
    """
    twice, arc = 2.0 * v * dt, wheelbase * abs(turn)
    if not (v > 0.0 and arc < twice):
        raise NoSuchAction(
            f"no steering turns a body at v={v} m/s by {turn} rad in {dt} s "
            f"(needs v > 0 and {wheelbase} * |turn| < 2 v dt = {twice})"
        )
    return math.atan2(2.0 * wheelbase * turn, math.sqrt(twice - arc) * math.sqrt(twice + arc))


def _wrap(angle: FloatArray) -> FloatArray:
    """`wrap` for arrays, equal to it bit for bit: fmod is exact, and so is each correction."""
    rest = np.fmod(angle, math.tau)
    rest = np.where(rest > math.pi, rest - math.tau, rest)
    return np.where(rest <= -math.pi, rest + math.tau, rest)


def _angles(
    v: FloatArray, steering: ArrayLike, wheelbase: float, dt: float
) -> tuple[FloatArray, FloatArray]:
    """Return (beta, theta) of the module's formula after checking all but v."""
    e = _steering(steering)
    _positive(wheelbase=wheelbase, dt=dt)
    beta = np.arctan(0.5 * np.tan(e))
    with np.errstate(over="ignore", invalid="ignore"):
        return beta, _finite("turn angle", 2.0 * (v * dt * np.sin(beta) / wheelbase))


def _finite(name: str, value: ArrayLike) -> FloatArray:
    """Return `value` as a float array or raise ValueError naming the argument."""
    array = np.asarray(value, dtype=np.float64)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {value!r}")
    return array


def _columns(name: str, value: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return x, y, v, o of a state, each of its leading shape."""
    array = _finite(name, value)
    if array.ndim == 0 or array.shape[-1] != 4:
        raise ValueError(f"{name} must have shape [..., 4] (x, y, v, o), got {array.shape}")
    return array[..., 0], array[..., 1], array[..., 2], array[..., 3]


def _steering(value: ArrayLike) -> FloatArray:
    e = _finite("steering", value)
    if not (np.abs(e) < 0.5 * math.pi).all():
        raise ValueError(f"|steering| must be below pi/2 rad, got {value!r}")
    return e


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not 0.0 < value < math.inf:
            raise ValueError(f"{name} must be positive and finite, got {value}")


def _require_action(possible: NDArray[np.bool_], theta: FloatArray) -> None:
    """Raise NoSuchAction that counts the elements without an action and names the first."""
    if possible.all():
        return
    bad = np.argwhere(~possible)
    first = tuple(int(i) for i in bad[0])
    raise NoSuchAction(
        f"no action for {len(bad)} of {possible.size} pairs of states, first at index {first}: "
        f"turn of {theta[first]} rad (needs v > 0 and b |theta| < 2 v dt)"
    )
