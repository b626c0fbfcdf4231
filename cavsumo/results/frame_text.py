"""The text of a trace's frames, formed straight from the snapshots.

It is the text that ``json.dumps`` makes of

    {"step": ..., "time_s": ..., "ego": [x, y, v, o], "steering": ..., "testers": {id: [...]},
     "background": {id: [...]}, "lights": ..., "actions": [[throttle, steering], ...]}

with every number in full precision. A trace has ten thousand numbers. Pydantic's serialiser finds
the shortest text of all of them in one call, ten times as quickly as Python; the two write only
numbers with an exponent differently.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import cache
from itertools import chain
from typing import Any

from pydantic import ConfigDict, TypeAdapter

from cavsumo.model.bodies import Action
from cavsumo.model.snapshot import Snapshot

Numbers = Sequence[float]
NEXT, BETWEEN = "], ", "], ["  # behind a group of numbers, and up to the next
UNLIKE = ("e", "0.0000")  # in numbers that Python may write in another way
_JSON = TypeAdapter[Any](Any, config=ConfigDict(ser_json_inf_nan="constants"))


def frames_text(frames: Iterable[Snapshot], actions: Iterable[Sequence[Action]] = ()) -> str:
    """Each snapshot as a line of a trace, with its end.

    Raises ValueError for a number that JSON does not have.

    Args:
        actions: what the testers' bodies did in each timestep; none at the end.
    """
    text, joints, key = _Text(), iter(actions), cache(_key)
    for snapshot in frames:
        text.add(f'{{"step": {snapshot.step}, "time_s": ', (snapshot.time,))
        text.add(', "ego": [', snapshot.ego[1:])
        text.add('], "steering": ', (snapshot.ego_steering,))
        for name, states in (
            ("testers", snapshot.testers),
            ("background", snapshot.raw_background),
        ):
            poses = {key(state[0].id): state[1:] for state in states}  # of one id the last
            text.add_groups(f', "{name}": {{', poses, poses.values(), "}")
        text.end += f', "lights": {json.dumps("".join(snapshot.lights))}'
        joint = next(joints, ())
        text.add_groups(', "actions": [', [f"{NEXT}["] * len(joint), joint, "]")
        text.end += "}\n"
    return text.joined()


class _Text:
    """A text with numbers in it, which become text at its end, all at once.

    Attributes:
        end: the text behind the last numbers.
    """

    def __init__(self) -> None:
        self.end = ""
        self._pieces: list[str] = []
        self._numbers: list[Numbers] = []  # those behind each of the pieces

    def add(self, piece: str, numbers: Numbers) -> None:
        """Go on with a piece of text and then with numbers, which commas separate."""
        self._pieces.append(self.end + piece)
        self._numbers.append(numbers)
        self.end = ""

    def add_groups(
        self, opening: str, pieces: Collection[str], numbers: Iterable[Numbers], closing: str
    ) -> None:
        """Go on with groups of numbers, each behind its piece, which ends the group before."""
        if not pieces:
            self.end += opening + closing
            return
        first = len(self._pieces)
        self._pieces.extend(pieces)
        self._numbers.extend(numbers)
        self._pieces[first] = self.end + opening + self._pieces[first].removeprefix(NEXT)
        self.end = "]" + closing

    def joined(self) -> str:
        """The whole text."""
        pairs = zip(self._pieces, _written(self._numbers), strict=True)
        return "".join(chain.from_iterable(pairs)) + self.end


def _key(name: str) -> str:
    """The text before the numbers of a body, behind those of another one."""
    return f"{NEXT}{json.dumps(name)}: ["


def _written(groups: Sequence[Numbers]) -> list[str]:
    """Numbers that stand together as text, of each group."""
    text = _JSON.dump_json(groups).decode().replace(",", ", ")  # "[[1.0, 2.0], [3.0]]"
    if "N" in text or "I" in text:  # of NaN or Infinity
        odd = next(n for group in groups for n in group if not abs(n) < float("inf"))
        raise ValueError(f"a number of a frame is {odd}, which JSON does not have")
    texts = text.split(BETWEEN)
    texts[0], texts[-1] = texts[0].removeprefix("[["), texts[-1].removesuffix("]]")
    for mark in UNLIKE:
        for i in _groups_with(mark, text):
            texts[i] = json.dumps(list(groups[i]))[1:-1]
    return texts


def _groups_with(mark: str, text: str) -> Iterator[int]:
    """The numbers of the groups in which a mark stands, which stands in few."""
    group, before, place = 0, 0, text.find(mark)
    while place >= 0:
        group, before = group + text.count(BETWEEN, before, place), place
        yield group
        place = text.find(mark, place + 1)
