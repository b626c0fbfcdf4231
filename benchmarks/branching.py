"""Branches of running episodes: are they exact, and what do they cost?

    python benchmarks/branching.py [--net NET]... [--branches N] [--costs N] [--many N]
                                   [--failures N] [--part PART]...

Identity: episodes with traffic are branched in several timesteps, by a fork and by a replay, with
the same agents, with others, with other actions, another ego and other random numbers; every
snapshot of both is compared, and so is the episode itself with one that was never branched. An ego
in another process must be refused. Cost:
processor time of both processes for branches of 30 timesteps after prefixes of several lengths.
Resources: processes, descriptors and memory after many branches. Failures: verdicts of reference
drivers by reruns from the start, by forks of one rerun, and as they are judged by default, with and
without the question for the ideal driver.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import os
import resource
import statistics
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

from cavsumo.agents.base import AGENTS
from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.egos import make_ego
from cavsumo.errors import BranchError
from cavsumo.model.bodies import NOOP
from cavsumo.model.forks import can_fork, cost_of_fork, result_of
from cavsumo.model.scenario import plan_from
from cavsumo.simulation import avoidability, checkpoints
from cavsumo.simulation.avoidability import AvoidabilityCheck
from cavsumo.simulation.branching import Continuation, branch, branches
from cavsumo.simulation.episode import Episode
from cavsumo.simulation.loop import EpisodeLoop, played_on

NETS = ("crossing", "junction", "pedestrians")
AT = (5, 25, 60)  # timesteps in which episodes are branched
BRANCH = 30  # timesteps of a branch whose cost is measured
DEFAULT, ONE = "default", "default without the ideal driver"
NOBODY: Callable[..., None] = lambda *_: None  # noqa: E731  # in place of the ideal driver's answer
OUTSIDE = Path(__file__).resolve().parent.parent / "examples/egos/stop_for_pedestrians.py"
PREFIXES = (20, 60, 200)
PARTS = ("identity", "cost", "resources", "failures")
SLOW = {"ego": "constant", "ego_params": {"speed": 1.0}}  # still on its way after all of them
BLIND = {"ego": "constant", "ego_params": {"speed": 7.0}, "agents": ["timing"]}


def main() -> None:
    """Measure and print; exit status 1 when any branch or verdict differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", action="append", help="a network; may be given more than once")
    parser.add_argument("--branches", type=int, default=100, help="compared, of each setting")
    parser.add_argument("--costs", type=int, default=9, help="repetitions, medians are shown")
    parser.add_argument("--many", type=int, default=1000, help="branches of which nothing may stay")
    parser.add_argument("--failures", type=int, default=10, help="episodes that are to be judged")
    parser.add_argument("--part", action="append", choices=PARTS, help="all by default")
    options = parser.parse_args()
    nets, chosen, good = options.net or NETS, options.part or PARTS, True
    if "identity" in chosen:
        good = all([identity(net, kind, options.branches) for net in nets for kind in ("", "car")])
        good &= refused(nets[0])
    if "cost" in chosen:
        for net in nets:
            cost(net, options.costs)
    if "resources" in chosen:
        good &= leftovers(nets[0], options.many)
    if "failures" in chosen:
        good &= all([failures(net, options.failures) for net in nets])
    sys.exit(0 if good else 1)


@contextmanager
def running(net: str, **settings: Any) -> Iterator[EpisodeRunner]:
    """A batch on a network in this process."""
    plan = plan_from({"net": net, "agents": ["random"], "testers": 2} | settings, "benchmark")
    with EpisodeRunner(prepare(plan)) as runner:
        yield runner


def begun(runner: EpisodeRunner, run: int) -> EpisodeLoop:
    """An episode at its start."""
    own = job(runner.plan, run)
    return EpisodeLoop(runner.setup, runner.agents_of(own), own.seed, record=True)


def digest(found: Episode | BranchError) -> str:
    """A checksum of all snapshots and the verdict; the sentence of an error."""
    if isinstance(found, BranchError):
        return f"error: {found}"
    return hashlib.sha256(repr((found.frames, found.judgement)).encode()).hexdigest()


def ways(loop: EpisodeLoop, seed: int) -> list[Continuation]:
    """How it is branched in one timestep."""
    teams = loop.setup.teams
    others = [AGENTS.make("proximity", {}) for _ in teams]
    still = [[[NOOP] * len(team) for team in teams]]
    return [
        Continuation(record=True),
        Continuation(seed=seed, record=True),
        Continuation(others, seed=seed, record=True),
        Continuation(actions=still, record=True),
        Continuation(ego=make_ego("constant", {"speed": 5.0}), record=True),
    ]


def identity(net: str, kind: str, branched: int) -> bool:
    """Branch episodes by both ways and compare; whether all are the same."""
    settings: dict[str, Any] = {"kind": kind, "agents": ["timing"]} if kind else {}
    settings |= {"traffic": "15", "end": 15.0}
    same = asked = errors = alone = episodes = 0
    with running(net, **settings) as runner:
        for run in itertools.count():
            if asked >= branched or run > branched:
                break
            whole = digest(played_on(begun(runner, run)))
            loop = begun(runner, run)
            for at in AT:
                while not loop.over and loop.snapshot.step < at:
                    loop.step()
                if loop.over or asked >= branched:
                    break
                told = ways(loop, run)[: branched - asked]
                forks = [digest(found) for found in branches(loop, told)]
                replays = [digest(found) for found in branches(loop, told, fork=False)]
                same += sum(a == b for a, b in zip(forks, replays, strict=True))
                errors += sum(a.startswith("error") for a in forks)
                asked += len(told)
            alone += digest(played_on(loop)) == whole
            episodes += 1
    print(
        f"identity {Path(net).stem[:24]:25}{kind or 'pedestrian':11} {same} of {asked} branches "
        f"the same ({errors} errors), {alone} of {episodes} episodes as if not branched",
        flush=True,
    )
    return (same, alone, errors) == (asked, episodes, 0)


def refused(net: str) -> bool:
    """Whether a branch of an episode with an ego in another process is refused; prints it."""
    with running(net, ego=f"exec:{sys.executable} {OUTSIDE}") as runner:
        runner.try_out()  # which starts the program
        loop = begun(runner, 0)
        loop.step()
        try:
            branch(loop, Continuation(steps=1))
        except BranchError as error:
            print(f"refused  {Path(net).stem[:24]:25}exec: {error}", flush=True)
            return True
    return False


def processor_time() -> float:
    """Of this process and its children that have ended [s]."""
    uses = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(use.ru_utime + use.ru_stime for use in uses)


def timed(work: Callable[[], object]) -> float:
    """Processor time of a work [ms]."""
    before = processor_time()
    work()
    return 1e3 * (processor_time() - before)


def cost(net: str, times: int) -> None:
    """Print what a branch costs after prefixes of several lengths."""
    with running(net, **SLOW, agents=["timing"], testers=3) as runner:
        for prefix in PREFIXES:
            loop = begun(runner, 0)
            while loop.snapshot.step < prefix and not loop.over:
                loop.step()
            if loop.over:
                print(f"cost {Path(net).stem[:24]:25}prefix {prefix}: the episode is over before")
                continue
            empty, fork, replay = branching(loop, times)
            anew = statistics.median(
                timed(lambda n=prefix + BRANCH: whole(runner, n)) for _ in range(times)
            )
            print(
                f"cost {Path(net).stem[:24]:25}prefix {prefix:4}: empty fork {empty:6.1f} ms, "
                f"branch {fork:6.1f} by fork, {replay:6.1f} by replay, {anew:6.1f} as an episode "
                f"of its own ({replay / fork:.1f} and {anew / fork:.1f} times a fork)",
                flush=True,
            )


def branching(loop: EpisodeLoop, times: int) -> list[float]:
    """Processor time of an empty fork, a branch by fork and one by replay, medians [ms]."""
    way = Continuation(steps=BRANCH)
    works: list[Callable[[], object]] = [
        lambda: result_of(int, 60.0),
        lambda: branch(loop, way),
        lambda: branch(loop, way, fork=False),
    ]
    spent = zip(*[[timed(work) for work in works] for _ in range(times)], strict=True)
    return [statistics.median(one) for one in spent]


def whole(runner: EpisodeRunner, steps: int) -> None:
    """An episode from its start."""
    loop = begun(runner, 0)
    while loop.snapshot.step < steps and not loop.over:
        loop.step()


def leftovers(net: str, many: int) -> bool:
    """Print what this process has at times during many branches; whether nothing stays of them."""
    with running(net) as runner:
        loop = begun(runner, 0)
        loop.step()
        told = [Continuation(seed=i, steps=1) for i in range(many)]
        for _ in branches(loop, told[:50]):
            pass
        before, peak = Held.now(), 0
        for i, _ in enumerate(branches(loop, told)):
            if i % max(1, many // 100) == 0:
                peak = max(peak, Held.now().children)
        after = Held.now()
    print(
        f"resources before {many} branches: {before}; after: {after}; at most {peak} children "
        "at a time",
        flush=True,
    )
    return (after.children, after.descriptors) == (before.children, before.descriptors)


class Held(NamedTuple):
    """The processes, descriptors and memory [MB] of this process."""

    children: int
    descriptors: int
    megabytes: float

    @classmethod
    def now(cls) -> Held:
        """At this moment."""
        here = Path("/proc/self")
        children = (here / "task" / str(os.getpid()) / "children").read_text().split()
        pages = int((here / "statm").read_text().split()[1])
        megabytes = pages * resource.getpagesize() / 1e6
        return cls(len(children), len(list((here / "fd").iterdir())), megabytes)

    def __str__(self) -> str:
        return f"{self.children} children, {self.descriptors} descriptors, {self.megabytes:.1f} MB"


def failures(net: str, runs: int) -> bool:
    """Judge failures by each way and compare; whether all verdicts are the same."""
    modes: dict[str, dict[str, Any]] = {
        "from the start": {"can_fork": lambda: False, "cost_of_fork": cost_of_fork},
        "forks of a rerun": {"can_fork": can_fork, "cost_of_fork": lambda: 0.0, "SLOW_S": 0.0},
        DEFAULT: {"can_fork": can_fork, "cost_of_fork": cost_of_fork},
        ONE: {"can_fork": can_fork, "cost_of_fork": cost_of_fork},
    }
    verdicts: dict[str, list[Any]] = {mode: [] for mode in modes}
    spent = dict.fromkeys(modes, 0.0)
    with running(net, **BLIND, testers=3) as runner:
        start = statistics.median(timed(lambda: begun(runner, 0)) for _ in range(3))
        for run in range(runs):
            for mode, patches in modes.items():
                asked = NOBODY if mode == ONE else AvoidabilityCheck._first_avoided
                with (
                    mock.patch.multiple(avoidability, **patches),
                    mock.patch.object(AvoidabilityCheck, "_first_avoided", asked),
                    mock.patch.object(checkpoints, "can_fork", lambda m=mode: m in (DEFAULT, ONE)),
                ):
                    before = processor_time()
                    row = runner.play(job(runner.plan, run)).outcome.row
                    spent[mode] += processor_time() - before
                told = [row[key] for key in ("outcome", "avoidable", "last_chance_s", "margin_s")]
                verdicts[mode].append((*told, row["avoidable_note"]))
    failed = sum(told[0] == "violated" for told in verdicts[DEFAULT])
    same = all(found == verdicts[DEFAULT] for found in verdicts.values())
    times = ", ".join(f"{1e3 * time / runs:.0f} {mode}" for mode, time in spent.items())
    print(
        f"failures {Path(net).stem[:24]:25}{failed} of {runs}, verdicts "
        f"{'the same' if same else 'DIFFERENT'}; start {start:.0f} ms; ms an episode: {times}",
        flush=True,
    )
    return same


if __name__ == "__main__":
    main()
