"""Results from forked children: in order, bounded, as errors where a child fails; nothing stays."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import alive, until

from cavsumo.errors import BranchError, SimulationError
from cavsumo.model import forks
from cavsumo.model.fork_child import places, stand_alone
from cavsumo.model.forks import can_fork, forked
from cavsumo.model.offspring import descendants

Work = Callable[[], Any]


@pytest.fixture(autouse=True)
def _nothing_is_left() -> Iterator[None]:
    """No child, dead or alive, and no descriptor is left of any of them."""
    before = resources()
    yield
    assert resources() == before


def resources() -> tuple[str, int]:
    """The children of this process, unburied ones too, and how many descriptors it has."""
    here = Path("/proc/self")
    children = (here / "task" / str(os.getpid()) / "children").read_text()
    return children, len(list((here / "fd").iterdir()))


def outcomes(*works: Work, at_once: int = 2, deadline: float = 30.0) -> list[Any]:
    """The results and errors of works."""
    return list(forked(works, at_once=at_once, deadline=deadline))


def said(work: Work, deadline: float = 30.0) -> str:
    """The error of a work that fails."""
    (error,) = outcomes(work, deadline=deadline)
    assert isinstance(error, BranchError)
    return str(error)


def test_results_come_in_the_order_of_the_works() -> None:
    """The first is the slowest, the third the largest."""

    def slow() -> int:
        time.sleep(0.05)
        return 1

    assert outcomes(slow, lambda: 2, lambda: bytes(3_000_000)) == [1, 2, bytes(3_000_000)]
    assert outcomes() == []


def test_children_at_once_are_bounded() -> None:
    """As long as the first works, only its neighbour was begun."""
    before = set(descendants(os.getpid()))
    works = forked([lambda: 0, *[lambda: time.sleep(60.0)] * 5], at_once=2, deadline=60.0)
    assert next(works) == 0
    assert len(set(descendants(os.getpid())) - before) == 1
    works.close()
    assert set(descendants(os.getpid())) == before


def test_a_failure_is_an_error_with_one_sentence() -> None:
    """Its own error, a defect, a result that cannot be sent, a crash, an end."""

    def raises(error: Exception) -> Any:
        raise error

    def killed() -> None:
        os.kill(os.getpid(), signal.SIGSEGV)

    assert said(lambda: raises(SimulationError("SUMO: no."))) == "SUMO: no."
    assert said(lambda: raises(ValueError("v"))) == "defect: ValueError('v')"
    assert said(lambda: lambda: 0).startswith("defect: ")
    assert said(killed) == "a branch died of SIGSEGV"
    assert said(lambda: os._exit(3)) == "a branch ended with status 3"
    assert said(lambda: sys.exit(2)) == "a branch ended with status 1"


@pytest.mark.parametrize("stopped", [False, True])
def test_whoever_takes_too_long_is_killed(stopped: bool) -> None:
    """Also if it is stopped; the others are not touched."""

    def hang() -> None:
        if stopped:
            os.kill(os.getpid(), signal.SIGSTOP)
        time.sleep(60.0)

    error, other = outcomes(hang, lambda: 7, deadline=1.0)
    assert str(error) == "a branch gave no result within 1 s"
    assert other == 7


def test_a_descriptor_closed_since_it_was_listed_is_left_alone() -> None:
    """Its number may be given to the null device, which a child then is not to copy onto itself."""

    def work() -> bool:
        number = os.open(os.devnull, os.O_RDONLY)
        os.close(number)  # the lowest number that is free
        stand_alone({number: None}, 30.0)
        return os.path.samestat(os.fstat(number), Path(os.devnull).stat())

    assert outcomes(work) == [True]


def test_a_child_takes_along_what_it_has_started(tmp_path: Path) -> None:
    """By its end, and by its deadline."""

    def starts(then: Work) -> Work:
        def work() -> int:
            pid = subprocess.Popen(["sleep", "60"]).pid
            (tmp_path / "pid").write_text(str(pid))
            then()
            return pid

        return work

    (pid,) = outcomes(starts(lambda: None))
    assert not alive(pid)
    said(starts(lambda: time.sleep(60.0)), deadline=1.0)
    assert not alive(int((tmp_path / "pid").read_text()))


def test_children_die_with_their_parent(tmp_path: Path) -> None:
    """A process that is killed leaves none of its branches behind."""

    def parent() -> None:
        def child() -> None:
            (tmp_path / "pid").write_text(str(os.getpid()))
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(60.0)

        outcomes(child)

    assert said(parent) == "a branch died of SIGKILL"
    until(lambda: not alive(int((tmp_path / "pid").read_text())), "the child ended")


def test_random_numbers_are_those_that_the_parent_would_draw() -> None:
    """Python seeds its generator anew in a fork, which would make branches differ."""
    drawn = outcomes(random.random, random.random, np.random.random)
    assert drawn == [(first := random.random()), first, np.random.random()]


@pytest.mark.parametrize("removed", [False, True])
def test_a_file_that_is_read_is_read_on_by_all(tmp_path: Path, removed: bool) -> None:
    """SUMO reads routes piece by piece: each process goes on from the same place."""
    file = tmp_path / "routes"
    file.write_bytes(b"0123456789")
    source = os.open(file, os.O_RDONLY)
    try:
        assert os.read(source, 4) == b"0123"
        if removed:
            file.unlink()
        assert outcomes(*[lambda: os.read(source, 3)] * 2) == [b"456", b"456"]
        assert os.read(source, 6) == b"456789"
    finally:
        os.close(source)


def test_what_a_child_writes_reaches_nobody(tmp_path: Path) -> None:
    """A conversation by a pipe, and SUMO's output files, belong to the parent alone."""
    file = tmp_path / "out"
    source, sink = os.pipe()
    try:
        with file.open("w") as out:

            def writes() -> int:
                out.write("child")
                out.flush()
                return os.write(sink, b"child")

            assert outcomes(writes) == [5]
            out.write("parent")
        os.write(sink, b"parent")
        assert os.read(source, 99) == b"parent"
        assert file.read_text() == "parent"
    finally:
        os.close(source)
        os.close(sink)


def test_a_file_may_be_closed_after_it_was_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing refers to it any more; its number belongs to who opens something next."""
    file = tmp_path / "garbage"
    file.touch()

    def listed() -> dict[int, int | None]:
        with file.open(), file.open():
            return places()

    monkeypatch.setattr(forks, "places", listed)
    source, sink = os.pipe()
    try:
        assert outcomes(lambda: os.write(sink, b"child")) == [5]
    finally:
        os.close(source)
        os.close(sink)


def test_linear_algebra_goes_on_in_a_fork() -> None:
    """Its threads do not exist in a fork, and are started anew."""
    a = np.random.default_rng(0).random((300, 300))
    product, solution = a @ a, np.linalg.solve(a, a[0])

    def again() -> bool:
        return bool((a @ a == product).all() and (np.linalg.solve(a, a[0]) == solution).all())

    assert outcomes(again, again) == [True, True]


def test_a_process_with_threads_is_not_forked() -> None:
    """What they hold would be held for ever."""
    before = can_fork()
    free = threading.Event()
    other = threading.Thread(target=free.wait)
    other.start()
    try:
        assert not can_fork()
    finally:
        free.set()
        other.join()
    assert can_fork() == before
