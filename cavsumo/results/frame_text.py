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
from collections.abc import Iterable, Sequence
from functools import cache
from itertools import chain, repeat
from typing import Any

from pydantic import ConfigDict, TypeAdapter

from cavsumo.model.bodies import Action
from cavsumo.model.snapshot import Snapshot

Numbers = Sequence[float]
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
            text.add_groups(f', "{name}": {{', poses.items(), "}")
        text.end += f', "lights": {json.dumps("".join(snapshot.lights))}'
        joint = next(joints, ())
        text.add_groups(', "actions": [', zip(repeat("["), joint, strict=False), "]")
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

    def add_groups(self, opening: str, groups: Iterable[tuple[str, Numbers]], closing: str) -> None:
        """Go on with groups of numbers, each behind a piece of text, which opens a bracket."""
        pieces, numbers = self._pieces, self._numbers
        before, after = self.end + opening, ""
        for piece, group in groups:
            pieces.append(before + piece)
            numbers.append(group)
            before, after = "], ", "]"
        self.end = (after or before) + closing

    def joined(self) -> str:
        """The whole text."""
        pairs = zip(self._pieces, _written(self._numbers), strict=True)
        return "".join(chain.from_iterable(pairs)) + self.end


def _key(name: str) -> str:
    """The text before the numbers of a body."""
    return f"{json.dumps(name)}: ["


def _written(groups: Sequence[Numbers]) -> list[str]:
    """Numbers that stand together as text, of each group."""
    text = _JSON.dump_json(groups).decode()
    if "N" in text or "I" in text:  # of NaN or Infinity
        odd = next(n for group in groups for n in group if not abs(n) < float("inf"))
        raise ValueError(f"a number of a frame is {odd}, which JSON does not have")
    texts = text[2:-2].replace(",", ", ").split("], [")
    if "e" in text or "0.0000" in text:
        for i, found in enumerate(texts):
            if "e" in found or "0.0000" in found:  # Python may write one of these another way
                texts[i] = json.dumps(list(groups[i]))[1:-1]
    return texts
