"""Requirements on every ego, of any kind: checks that play scripted drives to it.

Each check receives a function that makes the ego, and the ground, and returns a remark; it raises
AssertionError, or the ego's error, if the ego fails it.
"""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from cavsumo.assertions.contacts import STANDING_MPS
from cavsumo.egos.base import Acceleration, Command, Ego
from cavsumo.egos.effectors import checked
from cavsumo.errors import EgoError
from cavsumo.model.snapshot import Snapshot
from cavsumo.testing.scripts import CROWDED, EMPTY, LONG, ODD, Script, ScriptNetwork, drive

MakeEgo = Callable[[], Ego]
Check = Callable[[MakeEgo, ScriptNetwork], str]


@contextmanager
def prepared(make: MakeEgo, ground: ScriptNetwork) -> Iterator[Ego]:
    """An ego that is ready to drive."""
    ego = make()
    try:
        ego.prepare(ground.mission(CROWDED.steps))
        yield ego
    finally:
        ego.close()


def commands(ego: Ego, ground: ScriptNetwork, script: Script, seed: int = 1) -> list[Command]:
    """The answers of an ego to a script, each of them checked."""
    answers: list[Command] = []
    for snapshot, command in drive(ego, ground, script, seed):
        check_command(ego, command, snapshot, type(answers[0]) if answers else None)
        answers.append(command)
    return answers


def check_command(
    ego: Ego, command: Command, snapshot: Snapshot, before: type | None = None
) -> None:
    """Whether the ego's effectors can execute a command, of the sort that it gave before."""
    if command is None and before in (None, type(None)):
        return  # it leaves the driving to SUMO
    try:
        checked(command, before, ego.kind)
    except EgoError as error:
        raise AssertionError(f"at {snapshot.time:g} s: {error}") from error


# The checks


def check_start(make: MakeEgo, ground: ScriptNetwork) -> str:
    """It starts, takes the reset and answers the first snapshot."""
    begun = time.perf_counter()
    with prepared(make, ground) as ego:
        ready = time.perf_counter() - begun
        kind = ego.kind
        (first,) = itertools.islice(drive(ego, ground, EMPTY, 1), 1)
        check_command(ego, first[1], first[0])
    return (
        f"ready in {ready:.2f} s; {kind.length:g} m x {kind.width:g} m, answers {_sort(first[1])}"
    )


def check_empty_road(make: MakeEgo, ground: ScriptNetwork) -> str:
    """It drives along a road without anybody, lights green; every answer can be executed."""
    speeds: list[float] = []
    with prepared(make, ground) as ego:
        for snapshot, command in drive(ego, ground, EMPTY, 1):
            check_command(ego, command, snapshot)
            speeds.append(snapshot.ego.v)
    way, spent = sum(speeds) * ground.dt, len(speeds) * ground.dt
    moves = len(speeds) < EMPTY.steps or max(speeds[-50:]) > STANDING_MPS
    assert moves, f"it stands after {way:.1f} m, with nobody there"
    return f"{way:.0f} m in {spent:.1f} s"


def check_crowded_road(make: MakeEgo, ground: ScriptNetwork) -> str:
    """Sixty bodies around it; the remark has the time of its answers."""
    with prepared(make, ground) as ego:
        waits: list[float] = []
        act = ego.act

        def clocked(snapshot: Snapshot) -> Command:
            begun = time.perf_counter()
            command = act(snapshot)
            waits.append(time.perf_counter() - begun)
            return command

        ego.act = clocked  # type: ignore[method-assign]
        commands(ego, ground, CROWDED)
    median = 1e3 * statistics.median(waits)
    return f"median answer {median:.2f} ms, slowest {1e3 * max(waits):.2f} ms"


def check_reset_twice(make: MakeEgo, ground: ScriptNetwork) -> str:
    """The same episode gets the same answers after a whole, an interrupted and no episode."""
    with prepared(make, ground) as ego:
        first = commands(ego, ground, CROWDED)
        _same(first, commands(ego, ground, CROWDED), "after an episode")
        list(itertools.islice(drive(ego, ground, EMPTY, 2), 7))
        _same(first, commands(ego, ground, CROWDED), "after an episode that was broken off")
        ego.reset(ground.scene(ego.kind, 3))
        _same(first, commands(ego, ground, CROWDED), "after a reset without a drive")
    return f"{len(first)} answers, four times the same"


def check_two_at_once(make: MakeEgo, ground: ScriptNetwork) -> str:
    """Two of them, as two processes of a batch have them, do not disturb each other."""
    with prepared(make, ground) as ego, prepared(make, ground) as other:
        alone = commands(ego, ground, CROWDED)
        answers: tuple[list[Command], list[Command]] = ([], [])
        pair = drive(ego, ground, CROWDED, 1), drive(other, ground, EMPTY, 2)
        for here, there in itertools.zip_longest(*pair):
            for found, answer in zip(answers, (here, there), strict=True):
                if answer is not None:
                    found.append(answer[1])
        _same(alone, answers[0], "beside another one")
    return "they do not disturb each other"


def check_long_episode(make: MakeEgo, ground: ScriptNetwork) -> str:
    """Ten minutes in a jam."""
    with prepared(make, ground) as ego:
        answers = commands(ego, ground, LONG)
    return f"{len(answers)} answers"


def check_odd_numbers(make: MakeEgo, ground: ScriptNetwork) -> str:
    """Tiny, huge and negative numbers, headings at the seam, names with quotes."""
    with prepared(make, ground) as ego:
        answers = commands(ego, ground, ODD)
    return f"{len(answers)} answers"


CHECKS: Mapping[str, Check] = {
    "start": check_start,
    "empty road": check_empty_road,
    "crowded road": check_crowded_road,
    "reset twice": check_reset_twice,
    "two at once": check_two_at_once,
    "long episode": check_long_episode,
    "odd numbers": check_odd_numbers,
}


def _same(first: list[Command], again: list[Command], when: str) -> None:
    """Whether two lists of answers are the same, bit for bit."""
    for i, (a, b) in enumerate(zip(first, again, strict=False)):
        assert a == b, f"{when}: answer {i} was {_plain(a)} and is {_plain(b)}"
    assert len(first) == len(again), f"{when}: {len(again)} answers instead of {len(first)}"


def _plain(command: Command) -> str:
    """A command as a short text."""
    return "none" if command is None else ", ".join(f"{value!r}" for value in command)


def _sort(command: Command) -> str:
    """The type of a command, in words."""
    if command is None:
        return "nothing: SUMO drives"
    return "accelerations" if isinstance(command, Acceleration) else "throttle and steering"
