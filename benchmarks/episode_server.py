"""Episodes in forks of a process in which SUMO was started once, against a start for each.

    python benchmarks/episode_server.py [--net FILE]... [--episodes N] [--many N]

On each network and in each setting the same episodes are played in both ways, in turns: rows and
traces are compared, and processor time is printed for both, with that of a start of SUMO. Then
what many episodes leave behind, and the cost of episodes on the first and on the last network, as
users run them. Without ``--net`` the shipped networks and a grid
of about 2,000 edges with pavements and crossings, which netgenerate makes (``pip install
eclipse-sumo``).
"""

from __future__ import annotations

import argparse
import contextlib
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest import mock

from branching import processor_time

from cavsumo.batch import episode_server
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.episode_server import EpisodeServer
from cavsumo.batch.jobs import job
from cavsumo.batch.messages import Answer
from cavsumo.batch.prepared import prepare
from cavsumo.batch.worker import Worker
from cavsumo.model.fork_child import places
from cavsumo.model.scenario import plan_from
from cavsumo.network.osm.netconvert import sumo_home

NETS = ["crossing", "junction", "pedestrians"]
SETTINGS: dict[str, dict[str, Any]] = {
    "defaults": {},
    "traffic": {"traffic": "15,15"},
    "3 testers": {"testers": 3, "agents": ["random"]},
    "car": {"kind": "car"},
    "bicycle": {"kind": "bicycle", "traffic": "6"},
}
DEADLINE_S = 300.0
STARTS = 3  # of SUMO, of which the median is shown


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", action="append", help="a network; may be given more than once")
    parser.add_argument("--episodes", type=int, default=10, help="of each setting")
    parser.add_argument("--relative", type=int, default=100, help="of which the cost is compared")
    parser.add_argument("--many", type=int, default=2000, help="episodes of which nothing may stay")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        nets = options.net or [*NETS, grid(Path(folder))]
        good = [compared(net, name, options.episodes) for net in nets for name in SETTINGS]
        leftovers(nets[-1], options.many)
        relative([nets[0], nets[-1]], options.relative)  # last: who starts workers keeps a thread
    sys.exit(0 if all(good) else 1)


def grid(folder: Path, number: int = 23) -> str:
    """A grid with pavements and crossings."""
    file, home = folder / "grid.net.xml", sumo_home()
    netgenerate = home / "bin" / "netgenerate"
    words = ["--grid", "--grid.number", str(number), "--sidewalks.guess", "--crossings.guess"]
    environment = os.environ | {"SUMO_HOME": str(home)}
    subprocess.run([netgenerate, *words, "-o", file], check=True, capture_output=True,
                   env=environment)  # fmt: skip
    return str(file)


@contextmanager
def serving(net: str, settings: dict[str, Any], large: float) -> Iterator[EpisodeServer]:
    """A process that plays in forks on networks with that many lanes."""
    plan = plan_from({"net": net, "trace": "all", **settings}, "benchmark")
    with tempfile.TemporaryFile() as log, mock.patch.object(episode_server, "LARGE", large):
        own = frozenset(places())
        with EpisodeRunner(prepare(plan)) as runner:
            runner.try_out()
            yield EpisodeServer(runner, DEADLINE_S, (2, log.fileno()), own)


def compared(net: str, name: str, episodes: int) -> bool:
    """Play episodes both ways and print; whether all are the same."""
    answers: list[list[Answer]] = []
    spent: list[list[float]] = []
    settings = SETTINGS[name]
    for large in (0.0, float("inf")):
        with serving(net, settings, large) as server:
            plan, found, times = server.runner.plan, [], []
            for run in range(episodes + 2):
                before = processor_time()
                found.append(server.play(job(plan, run), lambda: None))
                times.append(processor_time() - before)
            if large:
                world = server.runner.setup.world
                start = statistics.median(timed(world.stand_by) for _ in range(STARTS))
            answers.append(found)
            spent.append(times[2:])  # the first is played here, the second pays for the start
    same = sum(episode_server.same(a, b) for a, b in zip(*answers, strict=True))
    notes = {answer.note for answer in answers[0] if answer.note}
    forks, starts = (1e3 * statistics.mean(times) for times in spent)
    print(
        f"{Path(net).stem[:24]:25}{name:11}{same:4} of {episodes + 2} the same; ms an episode: "
        f"{forks:7.1f} by a fork, {starts:7.1f} with a start ({starts / forks:5.2f}); a start "
        f"{1e3 * start:7.1f} {' '.join(notes)}",
        flush=True,
    )
    return same == episodes + 2 and not notes


def relative(nets: list[str], episodes: int) -> None:
    """Print what episodes cost on networks, as users run them, in turns; the first is 1."""
    spent: dict[str, list[float]] = {net: [] for net in nets}
    with contextlib.ExitStack() as stack:
        workers = {}
        for net in nets:
            plan = plan_from({"net": net, "runs": episodes + 2}, "benchmark")
            workers[net] = stack.enter_context(Worker(prepare(plan)))
        for run in range(episodes + 2):
            for net, worker in workers.items():
                before = time_of(worker)
                worker.play(job(worker.prepared.plan, run))
                spent[net].append(time_of(worker) - before)
    costs = {net: 1e3 * statistics.mean(times[2:]) for net, times in spent.items()}
    for net, cost in costs.items():
        print(f"{Path(net).stem[:24]:25}{cost:7.1f} ms an episode ({cost / costs[nets[0]]:.2f})")


def time_of(worker: Worker) -> float:
    """Processor time of a worker's process and its children that have ended [s]."""
    if worker._process is None:  # a test plays it in this process
        return processor_time()
    stat = Path(f"/proc/{worker._process.pid}/stat").read_text(encoding="ascii")
    ticks = stat.rpartition(")")[2].split()[11:15]
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def timed(work: Any) -> float:
    """Processor time of a work [s]."""
    before = processor_time()
    work()
    return processor_time() - before


def leftovers(net: str, many: int) -> None:
    """Print what is left of many episodes in this process."""
    with (
        tempfile.TemporaryDirectory() as folder,
        mock.patch.object(tempfile, "tempdir", folder),
        serving(net, {"trace": "tests"}, 0.0) as server,
    ):
        plan = server.runner.plan
        notes = {server.play(job(plan, run), lambda: None).note for run in range(20)}
        assert notes == {""}, notes
        before, since = held(), time.monotonic()
        for run in range(many):
            server.play(job(plan, run), lambda: None)
        print(f"before and after {many} episodes in forks: {before}; {held()}; "
              f"{time.monotonic() - since:.0f} s")  # fmt: skip


def held() -> str:
    """The processes, descriptors, temporary files and memory of this process."""
    here = Path("/proc/self")
    children = (here / "task" / str(os.getpid()) / "children").read_text().split()
    pages = int((here / "statm").read_text().split()[1])
    files = sum(1 for _ in Path(tempfile.gettempdir()).rglob("*"))
    return (
        f"{len(children)} children, {len(list((here / 'fd').iterdir()))} descriptors, "
        f"{files} files, {pages * resource.getpagesize() / 1e6:.0f} MB"
    )


if __name__ == "__main__":
    main()
