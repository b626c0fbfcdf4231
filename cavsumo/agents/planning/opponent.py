"""A model of the ego by counting: when it changes its acceleration, and to which value.

The ego's transition function is unknown but can be sampled (seed, section 2). Drivers do not decide
in every timestep: SUMO's hold an acceleration for their ``actionStepLength``. Two observable
quantities are counted:

* in how many timesteps with an acceleration of age ``held`` it was changed (a hazard), and
* which acceleration was taken, for each situation: how soon the body enters the strip that the ego
  sweeps, the deceleration needed to stop before it, the ego's speed.

Situations with few counts use coarser ones: a situation's distribution is its counts plus
``PSEUDO`` counts of the next coarser one (any speed; any entry from the lane; any deceleration
needed), and last of "it keeps its speed".
"""

from __future__ import annotations

import bisect
import itertools
from collections.abc import Iterable, Mapping
from typing import Any

# Situations. Seconds until the body enters the strip if it goes on; below the first it is inside.
ENTRY_S = (0.05, 0.25, 0.45, 0.65, 0.85, 1.15)
ON_THE_LANE = 4  # cells of entry in which the ego's driver sees the body before it, all alike
NEED_MPS2 = (0.5, 1.5, 3.0, 4.5, 6.5, 9.0)
SPEED_MPS = (1.0, 3.0, 6.0)
# Classes of acceleration, and the default mean of a class without counts [m/s2].
EDGES_MPS2 = (-6.5, -3.0, -1.0, -0.3, 0.3)
MIDDLES_MPS2 = (-8.0, -4.5, -2.0, -0.6, 0.0, 1.0)
KEEPS = 4  # the class of an ego that keeps its speed

CHANGE_MPS2 = 0.02  # an acceleration that differs by more is another one
STANDING_MPS = 0.1
OLDEST = 11  # ages from here on are one [timesteps]
PSEUDO = 2.0
MOST = 1e15  # a count or the amount of a sum of accelerations; larger ones are damaged

Key = tuple[int, int, int]


def situation(entry_s: float, gap: float, v: float) -> Key:
    """The cell of a situation.

    Args:
        entry_s: time until the body enters the ego's strip [s]; infinite if it is not on its way
            there.
        gap: from the ego's front to the body's near side, along the ego's path [m].
        v: speed of the ego [m/s].
    """
    need = v * v / (2.0 * gap) if gap > 0.05 else NEED_MPS2[-1] + 1.0
    return (
        bisect.bisect(ENTRY_S, entry_s),
        bisect.bisect(NEED_MPS2, need),
        bisect.bisect(SPEED_MPS, v),
    )


def acceleration_class(a: float) -> int:
    """The class of an acceleration [m/s2]."""
    return bisect.bisect(EDGES_MPS2, a)


class AccelerationReader:
    """Reads an ego's acceleration and its age off successive speeds.

    An ego is taken to have chosen its first acceleration as it entered.

    Attributes:
        acceleration: in the last timestep [m/s2].
        held: number of timesteps before the last one with the same acceleration, at most OLDEST.
        changed: whether it was chosen anew in the last timestep; None if that cannot be observed.
    """

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.acceleration, self.held = 0.0, 0
        self.changed: bool | None = None
        self._v: float | None = None
        self._known = False  # whether the acceleration before was the ego's choice

    def see(self, v: float) -> None:
        """The ego's speed at the next timestep."""
        before, self._v = self._v, v
        if before is None:
            return
        a, was = (v - before) / self.dt, self.acceleration
        self.acceleration, self.changed = a, None
        if v <= STANDING_MPS:  # its decisions cannot be observed while it stands
            self.held = OLDEST
        elif self._known:
            self.changed = abs(a - was) > CHANGE_MPS2
            self.held = 0 if self.changed else min(OLDEST, self.held + 1)
        self._known = True


class Counts:
    """The counts so far.

    Attributes:
        ages: [aware][held] -> [timesteps in which it was held, in which it was changed].
        taken: by situation, how often each class was chosen.
        sums: of the accelerations of each class, with their number.
    """

    def __init__(self) -> None:
        self.ages = [[[0, 0] for _ in range(OLDEST + 1)] for _ in range(2)]
        self.taken: dict[Key, list[int]] = {}
        self.sums = [[0.0, 0] for _ in MIDDLES_MPS2]

    def add(self, key: Key, held: int, a: float, *, changed: bool) -> None:
        """Count a timestep: ``held`` is the age before it, ``a`` the acceleration in it."""
        self.ages[aware(key)][held][changed] += 1
        if not changed:
            return
        which = acceleration_class(a)
        self.taken.setdefault(key, [0] * len(MIDDLES_MPS2))[which] += 1
        self.sums[which][0] += a
        self.sums[which][1] += 1

    @property
    def decisions(self) -> int:
        """How many decisions were seen."""
        return sum(sum(row) for row in self.taken.values())

    def hazard(self, aware_: int, held: int) -> float:
        """Probability that an acceleration of this age is replaced in the next timestep.

        An unknown ego decides in every timestep: one pseudo-count for that.
        """
        kept, changed = self.ages[aware_][held]
        both = sum(self.ages[k][held][1] for k in (0, 1)) + 1.0
        of = sum(sum(self.ages[k][held]) for k in (0, 1)) + 1.0
        return (changed + PSEUDO * both / of) / (kept + changed + PSEUDO)

    def middle(self, which: int) -> float:
        """The mean acceleration of a class [m/s2]."""
        total, n = self.sums[which]
        return (total + MIDDLES_MPS2[which]) / (n + 1)

    def chances(self, key: Key) -> list[float]:
        """Probabilities of the classes when it decides in a situation."""
        entry, need, _ = key
        near = range(ON_THE_LANE) if entry < ON_THE_LANE else range(entry, entry + 1)
        one, any_need, any_speed = [entry], range(len(NEED_MPS2) + 1), range(len(SPEED_MPS) + 1)
        chances = [float(which == KEEPS) for which in range(len(MIDDLES_MPS2))]
        for group in (
            itertools.product(near, any_need, any_speed),
            itertools.product(near, [need], any_speed),
            itertools.product(one, [need], any_speed),
            [key],
        ):
            counts = self._pooled(group)
            n = sum(counts) + PSEUDO
            chances = [(c + PSEUDO * p) / n for c, p in zip(counts, chances, strict=True)]
        return chances

    def _pooled(self, keys: Iterable[Key]) -> list[int]:
        """The counts of some situations together."""
        rows = [self.taken[key] for key in keys if key in self.taken]
        return [sum(column) for column in zip(*rows, strict=True)] or [0] * len(MIDDLES_MPS2)

    def floor(self, key: Key, confidence: float) -> list[float]:
        """Lower bounds that hold for all classes of a situation together (Clopper-Pearson).

        One-sided at (1 - confidence) / classes each, from the counts of that situation alone;
        the rest of 1 may lie on any class.
        """
        from scipy.stats import beta

        counts = self._pooled([key])
        n, risk = sum(counts), (1.0 - confidence) / len(counts)
        return [float(beta.ppf(risk, k, n - k + 1)) if k else 0.0 for k in counts]

    def plain(self) -> dict[str, Any]:
        """The counts as plain data."""
        taken = {",".join(map(str, key)): self.taken[key] for key in sorted(self.taken)}
        return {"ages": self.ages, "taken": taken, "sums": self.sums}

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Counts:
        """The counts from plain data; ValueError, KeyError or TypeError for invalid data."""
        counts = cls()
        counts.ages = [[[_count(n) for n in pair] for pair in ages] for ages in data["ages"]]
        counts.sums = [[float(total), _count(n)] for total, n in data["sums"]]
        for text, row in dict(data["taken"]).items():
            entry, need, speed = (_count(int(part)) for part in text.split(","))
            counts.taken[entry, need, speed] = [_count(n) for n in row]
        shape = [[len(pair) for pair in ages] for ages in counts.ages]
        if shape != [[2] * (OLDEST + 1)] * 2:
            raise ValueError("ages have another shape")
        if {len(counts.sums), *map(len, counts.taken.values())} != {len(MIDDLES_MPS2)}:
            raise ValueError(f"expected {len(MIDDLES_MPS2)} classes of acceleration")
        if not all(abs(total) <= MOST for total, _ in counts.sums):
            raise ValueError("sums must be finite and not too large")
        return counts


def _count(n: int) -> int:
    """A count; ValueError for anything else."""
    if n != int(n) or not 0 <= n <= MOST:
        raise ValueError(f"expected a count, got {n!r}")
    return int(n)


def aware(key: Key) -> int:
    """Whether the body of a situation is so near the strip that an ego may react to it."""
    return int(key[0] < len(ENTRY_S))
