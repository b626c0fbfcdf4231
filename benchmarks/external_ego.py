"""What it costs to ask an ego outside, against the same controller as a Python class.

    python benchmarks/external_ego.py [--net FILE] [--episodes N]

The example ego in its four forms (class, child process, server, child process in C) plays the same
episodes in turns, in one process. Rows are compared too. Then the parts of the exchange: writing an
observation, and an exchange with a program that does nothing but answer.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cavsumo.batch.prepared import prepare
from cavsumo.egos import Acceleration, Ego, make_ego
from cavsumo.egos.external.protocol import Observations, hello
from cavsumo.model.scenario import plan_from
from cavsumo.model.seeds import episode_seed
from cavsumo.simulation.loop import play
from cavsumo.simulation.setup import make_setup

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "examples" / "egos" / "stop_for_pedestrians.py"
WORDS = {"r": "red", "y": "yellow", "u": "red-yellow", "g": "green", "G": "green"}
ECHO = "import sys\nfor line in sys.stdin: print(sys.argv[1 + ('hello' not in line)], flush=True)"


class Timed(Ego):
    """An ego, with the real time that its answers take."""

    def __init__(self, ego: Ego) -> None:
        self.ego, self.kind, self.times, self.seen = ego, ego.kind, [], []
        self.prepare, self.reset, self.close = ego.prepare, ego.reset, ego.close

    def act(self, snapshot: Any) -> Any:
        begun = time.perf_counter()
        command = self.ego.act(snapshot)
        self.times.append(time.perf_counter() - begun)
        self.seen.append(snapshot)
        return command


class AsClass(Ego):
    """The example as a class that is called."""

    def __init__(self) -> None:
        spec = importlib.util.spec_from_file_location("example", EXAMPLE)
        self.example = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.example)

    def reset(self, scene: Any) -> None:
        kind = scene.ego.kind
        self.scene, self.path = scene, self.example.Path(scene.ego_path.points)
        self.constants = (scene.dt, kind.length, kind.width, kind.throttle_min, kind.throttle_max)

    def act(self, snapshot: Any) -> Acceleration:
        ego, along = snapshot.ego, self.scene.ego_progress(snapshot)
        front = along + ego.body.kind.length / 2
        lights = zip(self.scene.lights, snapshot.lights, strict=True)
        ahead = next(((t.along - front, WORDS[s]) for t, s in lights if t.along >= front), None)
        bodies = [
            (b.kind.name, x, y, o, v, b.kind.length, b.kind.width)
            for b, x, y, v, o in (*snapshot.testers, *snapshot.raw_background)
        ]
        told = self.path, self.constants, ego.v, along, ego.x, ego.y, ahead, bodies
        return Acceleration(self.example.acceleration(*told))


def main() -> None:
    """Play, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", default=str(ROOT / "networks" / "crossing.net.xml"))
    parser.add_argument("--episodes", type=int, default=10)
    options = parser.parse_args()
    plan = plan_from({"net": options.net, "trace": "none"}, "external")
    prepared = prepare(plan)
    with forms() as egos:
        stages = {
            name: make_setup(plan.scenario, prepared.site, Timed(ego)) for name, ego in egos.items()
        }
        for setup in stages.values():
            setup.ego.prepare(setup.mission)
        spent: dict[str, list[float]] = {name: [] for name in stages}
        steps = 0
        for i in range(options.episodes):
            seed, found = episode_seed(plan.seed, i), set()
            for name, setup in stages.items():
                begun = time.perf_counter()
                episode = play(setup, prepared.cast.agents("timing"), seed)
                spent[name].append((time.perf_counter() - begun) / episode.steps)
                found.add((episode.judgement, episode.steps, episode.contacts.min_gap))
            assert len(found) == 1, f"episode {i} differs: {found}"
            steps += episode.steps
        report(spent, stages, steps)
        parts(stages["exec, Python"])
        for setup in stages.values():
            setup.ego.close()


def report(spent: dict[str, list[float]], stages: dict[str, Any], steps: int) -> None:
    """One line for each form."""
    episodes = len(spent["class"])
    print(f"{episodes} episodes, {steps / episodes:.0f} timesteps each, the same in every form")
    print("medians          us a timestep   answering   more than the class   of its timestep")
    usual = statistics.median(spent["class"])
    called = statistics.median(stages["class"].ego.times)
    for name, setup in stages.items():
        answering = statistics.median(setup.ego.times)
        print(
            f"{name:16} {1e6 * statistics.median(spent[name]):13.0f} {1e6 * answering:11.0f} "
            f"{1e6 * (answering - called):21.0f} {(answering - called) / usual:17.1%}"
        )


def parts(setup: Any) -> None:
    """Where the time of an exchange goes."""
    seen = setup.ego.seen[:: max(1, len(setup.ego.seen) // 1000)]
    writer: Observations = setup.ego.ego._observations
    lines = [writer.line(s) for s in seen]
    print(
        f"an observation has {statistics.mean(map(len, lines)):.0f} bytes, "
        f"{statistics.mean(len(s.testers) + len(s.raw_background) for s in seen):.0f} bodies; "
        f"writing it takes {microseconds(seen, writer.line):.0f} us"
    )
    driver = AsClass().example.Driver()
    driver.answer(json.loads(hello(setup.mission, setup.ego.kind)))
    work = microseconds(lines, lambda line: json.dumps(driver.answer(json.loads(line))))
    print(f"reading it, deciding and answering takes Python {work:.0f} us")
    answers = '{"type": "hello", "version": 1}', '{"type": "ready", "acceleration": 0}'
    ego = make_ego(f"exec:{sys.executable} -c \"{ECHO}\" '{answers[0]}' '{answers[1]}'", {})
    ego.prepare(setup.mission)
    ask = ego._link.ask
    print(f"its exchange with a program that looks at nothing: "
          f"{microseconds(lines, lambda line: ask(line, 1.0)):.0f} us")  # fmt: skip
    ego.close()


def microseconds(things: list[Any], does: Callable[[Any], Any]) -> float:
    """The median real time of a call."""
    times = []
    for thing in things:
        begun = time.perf_counter()
        does(thing)
        times.append(time.perf_counter() - begun)
    return 1e6 * statistics.median(times)


@contextmanager
def forms() -> Iterator[dict[str, Ego]]:
    """The example ego in every form that can be had here."""
    line = [sys.executable, str(EXAMPLE), "--port", "0"]
    with (
        tempfile.TemporaryDirectory() as folder,
        subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as server,
    ):
        port = server.stdout.readline().split()[-1]
        egos = {
            "class": AsClass(),
            "exec, Python": make_ego(f"exec:{sys.executable} {EXAMPLE}", {}),
            "tcp, Python": make_ego(f"tcp:127.0.0.1:{port}", {}),
        }
        compiler, program = shutil.which("cc"), f"{folder}/ego"
        if compiler:
            source = str(EXAMPLE.with_suffix(".c"))
            subprocess.run([compiler, "-O2", "-o", program, source, "-lm"], check=True)
            egos["exec, C"] = make_ego(f"exec:{program}", {})
        try:
            yield egos
        finally:
            server.kill()


if __name__ == "__main__":
    main()
