"""Numbers packed into short text, for a page that holds many of them.

Integers, of which neighbours are alike, become differences, zigzag-coded (0, -1, 1, -2, ... are 0,
1, 2, 3, ...), seven bits a byte with the lowest first, in base64. ``player.js`` has the inverse.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence

MILLI = 1000.0  # positions in millimetres, speeds in mm/s, times in milliseconds
CENTI = 100.0  # of fixed objects: centimetres
ANGLE = 10_000.0  # tenths of a milliradian
NOTHING = -1  # stands for no value of a quantity that is never negative


def packed(values: Iterable[int]) -> str:
    """Integers as text, each as its difference from the one before."""
    data, last = bytearray(), 0
    for value in values:
        step, last = value - last, value
        code = 2 * step if step >= 0 else -2 * step - 1
        while code > 127:
            data.append(code & 127 | 128)
            code >>= 7
        data.append(code)
    return base64.b64encode(data).decode("ascii")


def unpacked(text: str) -> list[int]:
    """The integers of ``packed``."""
    values: list[int] = []
    last = code = shift = 0
    for byte in base64.b64decode(text):
        code |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            last += -(code + 1) // 2 if code & 1 else code // 2
            values.append(last)
            code = shift = 0
    return values


def columns(rows: Sequence[Sequence[float]], scales: Sequence[float]) -> str:
    """A table as text, column after column, each in units of 1 / scale."""
    return packed(round(row[i] * scale) for i, scale in enumerate(scales) for row in rows)


def shapes(parts: Iterable[Iterable[Sequence[float]]]) -> dict[str, str]:
    """Polygons or lines as text: their numbers of points and their coordinates [cm].

    All abscissae before all ordinates, so that neighbours are alike.
    """
    points = [[(round(p[0] * CENTI), round(p[1] * CENTI)) for p in part] for part in parts]
    flat = [point for part in points for point in part]
    return {
        "sizes": packed(len(part) for part in points),
        "points": packed([x for x, _ in flat] + [y for _, y in flat]),
    }
