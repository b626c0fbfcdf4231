"""Damaged input of every sort given to the command line: refusals, tracebacks, hangs.

    python benchmarks/fuzz.py [--cases 10000] [--seed 1] [--sort NAME ...] [--show 3]

Everything is read and checked in this process as ``cavsumo`` does it; where a simulation would
start, a case is accepted. Each case is damaged input derived from a whole one (``fuzz_cases``).
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from typing import Any
from unittest import mock

from fuzz_cases import Case, strategies, whole_files
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.worker import Worker
from cavsumo.cli import main as cavsumo
from cavsumo.egos.external import protocol
from cavsumo.errors import CavsumoError, EgoError, InputError

ROOT = Path(__file__).resolve().parent.parent
LIMIT_S = 20.0  # of processor time, whatever else the machine does
LONGEST = 500  # characters of a message
STATUSES = (0, 1, 2, 3, 130)
# Words of Python that mean nothing to somebody whose file is damaged.
PYTHON = re.compile(
    r"\b\w+(Error|Exception|Warning)\b|StopIteration|object has no|NoneType|list index"
    r"|subscriptable|unhashable|object is not|Traceback|<class|unexpected keyword|positional arg"
    r"|recursion|set_int_max|codec can't|Errno|not iterable|unpack|int\(\)|float\(\)"
    r"|not supported between|datetime\.|<.* at 0x|Fraction\("
)


class Accepted(BaseException):
    """A simulation would start now."""


class Hang(BaseException):
    """A case took too long."""


@dataclass(frozen=True)
class Verdict:
    """What became of a case.

    Attributes:
        end: refused, accepted, or what is wrong: traceback, hang, words, long, status, written.
        said: what was printed on stderr, or the traceback.
    """

    end: str
    said: str


GOOD = ("refused", "accepted")


# Played -------------------------------------------------------------------------------------------


def tried(case: Case, folder: Path) -> Verdict:
    """A case in a folder of its own, in this process."""
    for name, data in case.files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    before = _listing(folder)
    err = io.StringIO()
    try:
        with contextlib.chdir(folder), _limited(), contextlib.redirect_stderr(err):
            status = _called(case)
    except Accepted:
        return Verdict("accepted", "")
    except Hang:
        return Verdict("hang", traceback.format_exc())
    except SystemExit as end:  # --help, --version
        return Verdict("accepted" if end.code == 0 else "status", err.getvalue())
    except BaseException:
        return Verdict("traceback", traceback.format_exc())
    said = err.getvalue()
    if status in (0, 1):
        return Verdict("accepted", said)
    return Verdict(_wrong(status, said, before != _listing(folder)) or "refused", said)


def _called(case: Case) -> int:
    """The exit status of a case."""
    if case.words == ("reply",):
        return _replied(case.files["line"])
    start = _simulated if case.simulated else _accepted
    with (
        mock.patch.object(Worker, "start", start),
        mock.patch.object(Worker, "play", _accepted),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        return int(cavsumo(list(case.words)))


def _accepted(*_: object) -> None:
    """In place of the start of a process that simulates."""
    raise Accepted


def _simulated(worker: Worker) -> None:
    """Load the batch in SUMO and play an episode, in a fork, which may crash."""
    ours, theirs = Pipe()
    pid = os.fork()
    if pid == 0:
        try:
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            with EpisodeRunner(worker.prepared) as runner:
                runner.try_out()
                runner.play(job(worker.prepared.plan, 0))
            theirs.send(None)
        except (CavsumoError, OSError) as error:
            theirs.send(str(error))
        except Exception:
            theirs.send(traceback.format_exc())
        finally:
            os._exit(0)
    theirs.close()
    try:
        refusal = ours.recv() if ours.poll(5 * LIMIT_S) else "SUMO goes on for ever"
    except EOFError:
        refusal = "SUMO crashed"
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    if refusal is None:
        raise Accepted
    raise InputError(refusal)


def _replied(line: bytes) -> int:
    """The status of an ego's reply: 3 when it is refused."""
    read: list[Callable[[], Any]] = [
        lambda: protocol.check_hello(line),
        lambda: protocol.check_ready(line),
        lambda: protocol.is_left_over(line),
        lambda: protocol.answer(line, 3),
    ]
    status = 0
    for one in read:
        try:
            one()
        except EgoError as error:
            print(f"cavsumo: {error}", file=sys.stderr)
            status = 3
    return status


def _wrong(status: int, said: str, written: bool) -> str:
    """What is wrong with a refusal, empty for nothing."""
    lines = [line for line in said.splitlines() if line.strip()]
    if status not in STATUSES or not lines or not lines[-1].startswith("cavsumo: "):
        return "status"
    if PYTHON.search(said):
        return "words"
    if max(len(line.removeprefix("cavsumo: ")) for line in lines) > LONGEST or len(lines) > 4:
        return "long"
    return "written" if written else ""


def _listing(folder: Path) -> dict[str, tuple[int, int]]:
    """The files of a folder, with size and time."""
    stats = {str(f.relative_to(folder)): f.stat() for f in folder.rglob("*") if f.is_file()}
    return {name: (s.st_size, s.st_mtime_ns) for name, s in stats.items()}


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    """Raise Hang in what takes too long."""

    def ring(*_: object) -> None:
        raise Hang

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


# Counted ------------------------------------------------------------------------------------------


def fuzzed(
    name: str, cases: st.SearchStrategy[Case], count: int, number: int, folder: Path
) -> tuple[Counter[str], int, list[tuple[Case, Verdict]], float]:
    """Counts of the ends of many cases, the longest message, the bad ones, the slowest [s]."""
    ends, longest, bad, slowest = Counter[str](), 0, [], 0.0

    @seed(number)
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(cases)
    def play(case: Case) -> None:
        nonlocal longest, slowest
        place = folder / name
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        begun = time.perf_counter()
        verdict = tried(case, place)
        slowest = max(slowest, time.perf_counter() - begun)
        ends[verdict.end] += 1
        if verdict.end in GOOD:
            longest = max(longest, *map(len, verdict.said.splitlines() or [""]))
        else:
            bad.append((case, verdict))

    play()
    return ends, longest, bad, slowest


def main() -> None:
    """Fuzz and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--sort", action="append")
    parser.add_argument("--show", type=int, default=3, help="bad cases of each sort")
    options = parser.parse_args()
    sorts = strategies(whole_files(), simulated=True)
    chosen = options.sort or list(sorts)
    print(f"{'input':10} cases  refused  accepted  tracebacks  hangs  other  longest  slowest")
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen:
            count = options.cases // len(chosen)
            ends, longest, bad, slowest = fuzzed(
                name, sorts[name], count, options.seed, Path(folder)
            )
            other = sum(ends.values()) - sum(ends[e] for e in (*GOOD, "traceback", "hang"))
            print(
                f"{name:10} {sum(ends.values()):5}  {ends['refused']:7}  {ends['accepted']:8}  "
                f"{ends['traceback']:10}  {ends['hang']:5}  {other:5}  {longest:7}  "
                f"{slowest:5.1f} s",
                flush=True,
            )
            show(bad, options.show)


def show(bad: list[tuple[Case, Verdict]], most: int) -> None:
    """Print the first case of each sort of failure."""
    seen: Counter[str] = Counter()
    for case, verdict in bad:
        key = verdict.end + " " + re.sub(r"\d+|'[^']*'", "", verdict.said.strip()[-150:])
        seen[key] += 1
        if seen[key] == 1 and len(seen) <= most:
            print(f"--- {verdict.end}: cavsumo {' '.join(case.words)[:300]}")
            print("\n".join(line[:600] for line in verdict.said.splitlines()[-9:]))
    if bad:
        print(f"--- {len(seen)} kinds: {seen.most_common(most)}")


if __name__ == "__main__":
    main()
