"""The parts of an episode: where the CPU time of a simulating process goes.

    python benchmarks/budget.py [--net NET]... [--testers N]... [--agent NAME] [--episodes N]

Each episode is played as by default, with reruns and trace. A clock of CPU time interrupts the
process every few milliseconds, or as soon as SUMO returns, and the time since the last interruption
counts for what the process is at then. What SUMO does for a call counts where the call is made.
"""

from __future__ import annotations

import argparse
import gc
import itertools
import signal
import time
from collections import defaultdict
from pathlib import Path
from types import FrameType

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.model.scenario import plan_from

NETS = ("crossing", "junction")
INTERVAL_S = 0.004  # the system counts CPU time in such steps
RERUN = "simulation/avoidability.py"
OTHER = "the loop and all else"
# Parts by the place in the code, of which the innermost counts: a file, or a function in it.
PLACES = {
    "sumo/connection.py begin": "SUMO starts and ends",
    "sumo/connection.py advance": "SUMO's timesteps",
    "sumo/moved_bodies.py": "telling SUMO where testers are",
    "sumo/background.py": "reading the others",
    "sumo/ego_in_sumo.py": "reading the ego",
    "sumo/": "lights, reports, departures, snapshots",
    "agents/": "agents",
    "assertions/": "contacts, assertions, measures",
    "simulation/rewards.py": "rewards",
    "simulation/moving.py": "kinematics",
    "simulation/starting.py": "beginning in Python",
    "results/frame_text.py": "trace",
    "results/trace_file.py": "trace",
    "results/": "row",
}
RERUNS = {"start": "reruns: SUMO starts and ends", "rest": "reruns: the rest"}
ORDER = [*dict.fromkeys(PLACES.values()), OTHER, *RERUNS.values()]


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", action="append", help="a network, or several")
    parser.add_argument("--testers", type=int, action="append", help="a number, or several")
    parser.add_argument("--agent", default="timing")
    parser.add_argument("--episodes", type=int, default=100)
    options = parser.parse_args()
    columns = list(itertools.product(options.net or NETS, options.testers or (1, 3)))
    found = [parts(net, number, options.agent, options.episodes) for net, number in columns]
    names = [f"{Path(net).stem[:9]} {number}" for net, number in columns]
    print(f"{'ms an episode':42}" + "".join(f"{name:>13}" for name in names))
    for part in ORDER:
        print(f"{part:42}" + "".join(f"{own[part]:13.1f}" for own in found))
    print(f"{'together':42}" + "".join(f"{sum(own.values()):13.1f}" for own in found))


def parts(net: str, testers: int, agent: str, episodes: int) -> dict[str, float]:
    """The parts of the mean episode of a batch [ms]."""
    spent: dict[str, float] = defaultdict(float)
    last = 0.0

    def note(_: int, frame: FrameType | None) -> None:
        nonlocal last
        before, last = last, time.process_time()
        spent[part_of(frame)] += 1e3 * (last - before) / episodes

    plan = plan_from({"net": net, "testers": testers, "agents": (agent,)}, "benchmark")
    with EpisodeRunner(prepare(plan)) as runner:
        runner.play(job(plan, 0))
        gc.collect()
        gc.freeze()  # as simulating processes do
        signal.signal(signal.SIGPROF, note)
        signal.setitimer(signal.ITIMER_PROF, INTERVAL_S, INTERVAL_S)
        last = time.process_time()
        for run in range(episodes):
            runner.play(job(plan, run))
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return spent


def part_of(frame: FrameType | None) -> str:
    """The part to which a moment belongs, by what was called."""
    found = ""
    while frame is not None:
        _, _, file = frame.f_code.co_filename.rpartition("/cavsumo/")
        place = f"{file} {frame.f_code.co_name}"
        if place.startswith(RERUN):
            return RERUNS["start" if found == PLACES["sumo/connection.py begin"] else "rest"]
        if not found:
            found = next((part for name, part in PLACES.items() if place.startswith(name)), "")
        frame = frame.f_back
    return found or OTHER


if __name__ == "__main__":
    main()
