"""The careful and competent driver of UN R157 in the scenarios of the regulation.

Source: UN Regulation No. 157, annex 4, appendix 3: the driver who perceives a risk releases the
accelerator for 0.75 s and then brakes, with a jerk of 12.65 m/s3, up to 0.774 g. A collision that
this driver avoids is *preventable*. As in the public reference implementation (JRC-FSM, EUPL, whose
counts are those of docs/suites.md) cars are boxes of 4.3 m by 1.9 m that keep their direction, time
goes in steps of 0.1 s, the new speed moves the ego, releasing decelerates by 0.4 m/s2, and in a
cut-in the risk begins where the boxes overlap laterally with a time to collision of 2 s or less;
not yet where the other car leaves its lane by 0.375 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate

RATE_HZ = 10
STEP_S = 1 / RATE_HZ
STEPS = 350
LENGTH_M, WIDTH_M = 4.3, 1.9
DELAY_S, RELEASE_MPS2, JERK_MPS3, FULL_MPS2 = 0.75, 0.4, 12.65, 0.774 * 9.81
CRITICAL_S = 2.0  # time to collision
BESIDE_M = 1.6 + WIDTH_M  # between the middles of neighbouring lanes' cars
LATERAL_MPS2 = 1.5  # with which a car begins to move to the side
HEADWAY_S = 2.0
CUT_OUT_M = 0.375  # how far a car moves to the side before it shows what it hid


@dataclass
class CarefulDriver:
    """The driver's speed and place, and how far its reaction is."""

    x: float
    v: float
    waits: float = DELAY_S
    deceleration: float = 0.0

    def go(self, *, risk: bool) -> None:
        """One timestep."""
        if risk and self.waits > 0.0:
            self.waits -= STEP_S
            self.deceleration = RELEASE_MPS2
            self.v -= RELEASE_MPS2 * STEP_S
        elif risk:
            self.deceleration = min(self.deceleration + JERK_MPS3 * STEP_S, FULL_MPS2)
            self.v = max(self.v - self.deceleration * STEP_S, 0.0)
        self.x += self.v * STEP_S


def cut_in_preventable(ego_mps: float, other_mps: float, gap_m: float, lateral_mps: float) -> bool:
    """Whether the driver avoids a slower car that cuts in.

    Args:
        ego_mps, other_mps: speeds along the road [m/s].
        gap_m: from the ego's front to the other's rear when it has its lateral speed [m].
        lateral_mps: its lateral speed towards the ego [m/s], reached with 1.5 m/s2.
    """
    lateral = _lateral_places(lateral_mps)
    before = len(lateral) - STEPS - 1  # timesteps in which the lateral speed rises
    driver = CarefulDriver(-before * ego_mps * STEP_S, ego_mps)
    others = accumulate(
        [other_mps * STEP_S] * (len(lateral) - 1),
        initial=gap_m + LENGTH_M - before * other_mps * STEP_S,
    )
    for x, y in zip(others, lateral, strict=True):
        beside, ahead = abs(y) - WIDTH_M, x - driver.x - LENGTH_M
        if beside < 0.0 and abs(x - driver.x) < LENGTH_M:
            return False
        risk = driver.x <= x and beside <= 0.0
        if risk and _time_to(ahead, driver.v - other_mps) > CRITICAL_S:
            return True  # it is far enough ahead as it cuts in
        driver.go(risk=risk)
    return True


def _lateral_places(lateral_mps: float) -> list[float]:
    """The lateral places of a car that cuts in, the rise of its speed included [m]."""
    rise = math.ceil(lateral_mps * RATE_HZ / LATERAL_MPS2)
    rising = accumulate(LATERAL_MPS2 / RATE_HZ * k / RATE_HZ for k in reversed(range(rise)))
    moving = int(RATE_HZ * BESIDE_M // lateral_mps + 1) if lateral_mps else 0
    then = accumulate(-lateral_mps if k < moving else 0.0 for k in range(STEPS))
    before = [BESIDE_M + way for way in rising]
    return [*reversed(before), BESIDE_M, *(BESIDE_M + way / RATE_HZ for way in then)]


def _time_to(gap: float, closing: float) -> float:
    """Time to collision [s]; infinite without closing."""
    return math.inf if closing == 0.0 else abs(gap / closing)


def deceleration_preventable(mps: float, deceleration: float) -> bool:
    """Whether the driver avoids a car that brakes 2 s ahead of it at the same speed.

    Args:
        mps: of both [m/s].
        deceleration: of the car ahead, from the first moment on [m/s2].
    """
    driver = CarefulDriver(mps * STEP_S, mps)
    speeds = [max(0.0, mps - k * deceleration * STEP_S) for k in range(STEPS)]
    begin = HEADWAY_S * mps + LENGTH_M
    for x in accumulate((v * STEP_S for v in speeds[1:]), initial=begin + speeds[0] * STEP_S):
        if abs(x - driver.x) < LENGTH_M:
            return False
        stood = driver.v == 0.0
        driver.go(risk=True)
        if stood:
            return True
    return True


def cut_out_preventable(mps: float, gap_m: float, lateral_mps: float) -> bool:
    """Whether the driver avoids a standing car that the car ahead, 2 s before it, leaves behind.

    Args:
        mps: of the driver and of the car ahead [m/s].
        gap_m: between the car ahead and the standing one when it begins to move to the side [m].
        lateral_mps: its lateral speed [m/s].
    """
    driver = CarefulDriver(mps * STEP_S, mps)
    x, y = HEADWAY_S * mps + LENGTH_M + mps * STEP_S, lateral_mps * STEP_S
    standing = HEADWAY_S * mps + 2 * LENGTH_M + gap_m
    moving = int(4.0 / STEP_S // lateral_mps + 1)
    crashed = False
    for k in range(STEPS - 1):
        if not crashed and y < WIDTH_M and abs(standing - x) < LENGTH_M:
            crashed = True  # the car ahead hits it, and is what the driver meets
        shown = crashed or y > CUT_OUT_M
        meets = x if crashed else standing
        if shown and abs(meets - driver.x) < LENGTH_M and (not crashed or y < WIDTH_M):
            return False
        stood = driver.v == 0.0
        driver.go(risk=shown)
        if stood:
            return True
        if not crashed:
            x += mps * STEP_S
            y += lateral_mps * STEP_S if k + 1 < moving else 0.0
    return True
