"""The text of a trace's frames, formed straight from the snapshots.

It is the text that ``json.dumps`` makes of

    {"step": ..., "time_s": ..., "ego": [x, y, v, o], "steering": ..., "testers": {id: [...]},
     "background": {id: [...]}, "lights": ..., "actions": [[throttle, steering], ...]}

with every number in full precision. A trace has ten thousand numbers: to make the dictionaries
first and then the text of them costs twice the time.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import zip_longest

from cavsumo.model.bodies import Action
from cavsumo.model.snapshot import BodyState, RawState, Snapshot

_number = float.__repr__  # of numpy's floats too
# Of each body its last state, the text of that, as many bodies stand, and the text of its id.
Known = dict[str, tuple[BodyState | RawState, str, str]]


def frame_lines(
    frames: Iterable[Snapshot], actions: Iterable[Sequence[Action]] = ()
) -> Iterator[str]:
    """Each snapshot as a line of a trace, with its end.

    Raises ValueError for a number that JSON does not have.

    Args:
        actions: what the testers' bodies did in each timestep; none at the end.
    """
    known: Known = {}
    for snapshot, joint in zip_longest(frames, actions, fillvalue=()):
        assert isinstance(snapshot, Snapshot)
        yield _line(snapshot, joint, known)


def _line(snapshot: Snapshot, joint: Sequence[Action], known: Known) -> str:
    """A snapshot as a line; ``known``: the last states of all bodies so far."""
    return (
        f'{{"step": {snapshot.step}, "time_s": {_numbers([snapshot.time])}, '
        f'"ego": [{_numbers(snapshot.ego[1:])}], '
        f'"steering": {_numbers([snapshot.ego_steering])}, '
        f'"testers": {{{_poses(snapshot.testers, known)}}}, '
        f'"background": {{{_poses(snapshot.raw_background, known)}}}, '
        f'"lights": {json.dumps("".join(snapshot.lights))}, '
        f'"actions": [{", ".join([f"[{_numbers(action)}]" for action in joint])}]}}\n'
    )


def _poses(states: Sequence[BodyState | RawState], known: Known) -> str:
    """Bodies and their states, of bodies with one id the last."""
    poses: dict[str, str] = {}
    for state in states:
        name = state[0].id
        before, text, key = known.get(name) or (None, "", json.dumps(name))
        if before != state:  # it moved
            text = f"{key}: [{_numbers(state[1:])}]"
            known[name] = state, text, key
        poses[name] = text
    return ", ".join(poses.values())


def _numbers(values: Sequence[float]) -> str:
    """Numbers as text, one after the other."""
    try:
        text = ", ".join(map(_number, values))
    except TypeError:  # one is a whole number
        text = json.dumps(list(values), allow_nan=False)[1:-1]
    if "n" in text:  # of nan or inf
        raise ValueError(f"a number of a frame is {text}, which JSON does not have")
    return text
