"""CPU time of an episode: a bare libsumo loop, the simulator alone, a whole episode, the command.

    python benchmarks/speed.py [--other FOLDER] [--net NET] [--testers N] [--agent NAME]
                               [--episodes N] [--rounds N] [--no-command]

Another version of the repository, in another folder, is measured in the same run, in turns, against
the bare loop of its own episodes (``throughput``). Each version plays in a process of its own, and
so does its bare loop, each episode in several rounds, of which the fastest counts. *Alone* is the
loop of agents, SUMO and assertions; *whole* what the simulating process does for a row by default:
the loop with everybody recorded, reruns with the reference driver, row and trace. *Command* is
``cavsumo run`` as users run it, all its processes together, less the same command with one episode;
it needs many episodes, or the noise of two starts weighs more than they do.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
NETS = [str(ROOT / "networks" / f"{name}.net.xml") for name in ("crossing", "junction")]
SHOWN = ("alone", "whole", "command")


@dataclass(frozen=True)
class Measured:
    """What is measured: a batch of one agent."""

    net: str
    testers: int
    agent: str
    episodes: int


def main() -> None:
    """Measure and print the table, or play for another process."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--other", type=Path, help="the folder of another version")
    parser.add_argument("--net", action="append", help="a network, or several")
    parser.add_argument("--testers", type=int, action="append", help="a number, or several")
    parser.add_argument("--agent", default="timing")
    parser.add_argument("--episodes", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--no-command", action="store_true", help="do not measure the command")
    parser.add_argument("--play", choices=("bare", "cavsumo"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    nets = options.net or NETS
    testers = options.testers or [1, 3]
    if options.play:
        batch = Measured(nets[0], testers[0], options.agent, options.episodes)
        play(batch, bare=options.play == "bare")
        return
    folders = [ROOT] + ([options.other.resolve()] if options.other else [])
    print(f"{'ms an episode, times bare':34}{'bare':>8}" + "".join(f"{name:>16}" for name in SHOWN))
    for net in nets:
        for number in testers:
            batch = Measured(net, number, options.agent, options.episodes)
            found = compare(batch, folders, options.rounds, command=not options.no_command)
            for folder, spent in zip(folders, found, strict=True):
                show(batch, folder, spent)


def show(batch: Measured, folder: Path, spent: list[float]) -> None:
    """Print a line: milliseconds, and as many times the bare loop."""
    name = f"{Path(batch.net).name.partition('.')[0]}, {batch.testers} testers, {folder.name}"
    bare, *others = spent
    times = "".join(f"{ms:9.1f} ({ms / bare:.2f})" for ms in others)
    print(f"{name:34}{bare:8.1f}{times}", flush=True)


def compare(
    batch: Measured, folders: list[Path], rounds: int, *, command: bool
) -> list[list[float]]:
    """Milliseconds of an episode in each version: bare, alone, whole, command; in turns."""
    ways = ("bare", "cavsumo")
    players = [[Player(folder, batch, way) for way in ways] for folder in folders]
    alone: list[list[list[float]]] = [[] for _ in players]  # of each version and episode
    for run in range(batch.episodes):
        taken = [
            [bare.played(run) + ours.played(run) for bare, ours in players] for _ in range(rounds)
        ]
        for own, times in zip(alone, zip(*taken, strict=True), strict=True):
            own.append([min(of) for of in zip(*times, strict=True)])
    for player in chain.from_iterable(players):
        player.close()
    found = [[1e3 * sum(of) / batch.episodes for of in zip(*own, strict=True)] for own in alone]
    if command:
        taken_s = [[command_s(folder, batch) for folder in folders] for _ in range(rounds)]
        for times, of in zip(found, zip(*taken_s, strict=True), strict=True):
            times.append(1e3 * min(of) / (batch.episodes - 1))
    return found


class Player:
    """A process with a version of the code, which plays episodes one way when it is told."""

    def __init__(self, folder: Path, batch: Measured, way: str) -> None:
        words = ["--play", way, "--net", batch.net, "--testers", str(batch.testers)]
        words += ["--agent", batch.agent, "--episodes", str(batch.episodes)]
        self._process = subprocess.Popen(
            [sys.executable, "-P", __file__, *words],  # this folder is not searched for modules
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment(folder),
            text=True,
        )

    def played(self, run: int) -> list[float]:
        """Seconds of the bare loop, or of the simulator alone and of a whole episode."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{run}\n")
        self._process.stdin.flush()
        return [float(word) for word in self._process.stdout.readline().split()]

    def close(self) -> None:
        """End it."""
        self._process.communicate()


def environment(folder: Path) -> dict[str, str]:
    """The environment in which a version is imported."""
    return dict(os.environ) | {"PYTHONPATH": f"{folder}{os.pathsep}{folder / 'benchmarks'}"}


def play(batch: Measured, *, bare: bool) -> None:
    """Play the episodes that stdin names, by the bare loop or by cavsumo, and tell the seconds."""
    loop: Any = importlib.import_module("throughput")
    given = {"net": batch.net, "testers": batch.testers, "agents": (batch.agent,)}
    told, sys.stdout = sys.stdout, sys.stderr
    tracks: dict[str, Any] = {}
    if bare:
        start_as_ever()
    with ExitStack() as stack:
        version = opened(given, stack)
        gc.collect()
        gc.freeze()  # as simulating processes do
        for run in sys.stdin:
            one = version.job(int(run))
            if bare and run not in tracks:
                frames = version.alone(int(run), record=True).frames
                tracks[run] = [[loop.to_bare(t) for t in s.testers] for s in frames]
            calls: list[Callable[[], Any]] = [
                partial(version.alone, int(run)),
                partial(version.whole, one),
            ]
            if bare:
                calls = [partial(loop.bare_loop, version.world, one.seed, tracks[run])]
            print(*map(seconds, calls), file=told, flush=True)


def start_as_ever() -> None:
    """Let SUMO start as in any program: its XML parser is not kept from one start to the next."""
    try:
        connection: Any = importlib.import_module("cavsumo.sumo.connection")
    except ImportError:  # version 0.1
        return
    connection.keep_xml = lambda _: None


def seconds(call: Callable[[], Any]) -> float:
    """CPU time of a call [s]."""
    begun = time.process_time()
    call()
    return time.process_time() - begun


@dataclass(frozen=True)
class Version:
    """A batch set up in this process.

    Attributes:
        world: its world.
        job: the job of a run.
        alone: plays a run by the loop alone.
        whole: plays a job to its row and its trace.
    """

    world: Any
    job: Callable[[int], Any]
    alone: Callable[..., Any]
    whole: Callable[[Any], Any]


def opened(given: dict[str, Any], stack: ExitStack) -> Version:
    """A batch set up by the version that is imported here."""
    try:
        from cavsumo.batch.episode_runner import EpisodeRunner
        from cavsumo.batch.jobs import job
        from cavsumo.batch.prepared import prepare
        from cavsumo.model.scenario import plan_from
        from cavsumo.simulation.loop import play as played
    except ImportError:
        return opened_01(given, stack)
    runner = stack.enter_context(EpisodeRunner(prepare(plan_from(given, "benchmark"))))

    def alone(run: int, **how: Any) -> Any:
        one = job(runner.plan, run)
        return played(runner.setup, runner.agents_of(one), one.seed, **how)

    return Version(runner.setup.world, partial(job, runner.plan), alone, runner.play)


def opened_01(given: dict[str, Any], stack: ExitStack) -> Version:
    """The same in version 0.1, whose modules stood elsewhere."""
    names = ("jobs", "scenario", "setting", "simulator", "theatre")
    jobs, scenario, setting, simulator, theatre = (
        importlib.import_module(f"cavsumo.{name}") for name in names
    )
    plan = scenario.plan_from(given, "benchmark")
    played = stack.enter_context(theatre.Theatre(plan, setting.prepare(plan).site))

    def alone(run: int, **how: Any) -> Any:
        one = jobs.job(plan, run)
        return simulator.play(played.stage, played._cast(one), one.seed, **how)

    return Version(played.stage.world, partial(jobs.job, plan), alone, played.play)


def command_s(folder: Path, batch: Measured) -> float:
    """CPU time of the command, all its processes, without that of its first episode [s]."""
    return spent_s(folder, batch, batch.episodes) - spent_s(folder, batch, 1)


def spent_s(folder: Path, batch: Measured, runs: int) -> float:
    """CPU time of the command with so many episodes [s]."""
    words = ["-m", "cavsumo", "run", "--net", batch.net, "--testers", str(batch.testers)]
    words += ["--agent", batch.agent, "--runs", str(runs), "-j", "1", "-q", "--exit-zero"]
    with TemporaryDirectory() as place:
        process = subprocess.Popen(
            [sys.executable, *words, "-o", f"{place}/r.csv"], env=environment(folder)
        )
        _, status, used = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{folder}: the command failed")
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
