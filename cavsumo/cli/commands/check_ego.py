"""``cavsumo check-ego``: whether an ego does what every ego must, before it costs a batch."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any

from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.batch.worker import Worker
from cavsumo.egos import Ego, make_ego
from cavsumo.errors import CavsumoError, EgoError, Exit
from cavsumo.model.scenario import plan_from
from cavsumo.results.columns import COLUMNS
from cavsumo.results.rows import cell
from cavsumo.testing.ego_checks import CHECKS, Check
from cavsumo.testing.scripts import ground

EPISODES = 2
SUMO_S = 60.0  # what the episodes in SUMO may take in any case


def check_ego(settings: Mapping[str, Any], deadline: float) -> int:
    """Play every check to an ego, then two episodes in SUMO; say what passes and what does not.

    Args:
        settings: of a scenario, with ``net`` and ``ego``.
        deadline: how long a check without SUMO may take [s].
    """
    scenario = plan_from(settings, "check-ego").scenario

    def make() -> Ego:
        return make_ego(scenario.ego, scenario.ego_params)

    here = ground(scenario.net_file, make().kind, scenario.step_length)

    def scripted(check: Check) -> Callable[[], str]:
        return lambda: check(make, here)

    rounds = {name: scripted(check) for name, check in CHECKS.items()}
    failed = sum([not _passed(name, check, deadline) for name, check in rounds.items()])
    limit = max(SUMO_S, deadline)
    failed += not _passed("in SUMO", lambda: _in_sumo(settings, limit), limit)
    done = f"{len(rounds) + 1} checks of ego {scenario.ego}"
    print(f"{done}: all passed" if not failed else f"{done}: {failed} failed")
    return Exit.VIOLATED if failed else Exit.OK


def _passed(name: str, check: Callable[[], str], deadline: float) -> bool:
    """Carry out a check and print its line."""
    try:
        with _limited(deadline):
            remark, passed = check(), True
    except (AssertionError, CavsumoError) as error:
        remark, passed = " ".join(str(error).split()), False
    except Exception as error:  # of the ego's
        remark, passed = " ".join(f"raised {type(error).__name__}: {error}".split()), False
    print(f"{'ok' if passed else 'FAIL':4}  {name:14}  {remark}", flush=True)
    return passed


def _in_sumo(settings: Mapping[str, Any], deadline: float) -> str:
    """The same episode twice, by one process in SUMO."""
    quiet = {**settings, "trace": "none", "reference": "none", "runs": 1, "deadline_s": deadline}
    prepared = prepare(plan_from(quiet, "check-ego"))
    with Worker(prepared) as worker:
        rows = [worker.play(job(prepared.plan, 0)).outcome.row for _ in range(EPISODES)]
    for row in rows:
        assert row["outcome"] != "error", row["error"]
    for column in (c for c in COLUMNS if c != "wall_s"):
        first, again = (cell(row.get(column)) for row in rows)
        assert first == again, f"the same episode again: {column} was {first!r} and is {again!r}"
    return f"{EPISODES} episodes of {rows[0]['time_s']:g} s, the same row: {rows[0]['outcome']}"


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Interrupt what takes longer, a controller that never answers."""

    def late(number: int, frame: FrameType | None) -> None:
        raise EgoError(f"not done within {seconds:g} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
