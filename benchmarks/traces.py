"""Bytes of a trace, and the CPU time to form, to compress and to read it.

    python benchmarks/traces.py [--episodes N] [--rounds N]

The parts of an episode that is recorded anyway: what it takes to make its trace file in the
simulating process, and to read that again. Each is done in several rounds, the fastest counts.
"""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import prepare
from cavsumo.model.scenario import plan_from
from cavsumo.results.frame_text import frames_text
from cavsumo.results.trace_file import GZIP, LEVEL, packed, unpacked
from cavsumo.results.traces import parsed, trace_text
from cavsumo.simulation.loop import play
from cavsumo.simulation.playback import by_body

ROOT = Path(__file__).resolve().parent.parent
NETWORKS = ("crossing", "junction")
LEVELS = (1, 2, 3, 6, 9)


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=30)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    for name in NETWORKS:
        texts, form = traces(name, options.episodes, options.rounds)
        size = sum(map(len, texts))
        print(f"{name}: {len(texts)} traces, {size / len(texts) / 1e3:.0f} kB of text each")
        print(f"  frames to text        {form:6.2f} ms")
        for step, call in (("compressed", packed), ("decompressed", read), ("parsed", parsed)):
            given = [packed(text) for text in texts] if call is read else texts
            print(f"  {step:21} {mean_ms(call, given, options.rounds):6.2f} ms")
        for level in LEVELS:
            share = sum(len(by_level(level, text)) for text in texts) / size
            taken = mean_ms(partial(by_level, level), texts, options.rounds)
            chosen = " *" if level == LEVEL else ""
            print(f"  level {level}{chosen:2} {share:6.1%} of it {taken:6.2f} ms")


def traces(name: str, episodes: int, rounds: int) -> tuple[list[str], float]:
    """The texts of the traces of a network, and how long their frames take [ms]."""
    plan = plan_from(
        {"net": str(ROOT / "networks" / f"{name}.net.xml"), "trace": "all"}, "benchmark"
    )
    texts, spent = [], 0.0
    with EpisodeRunner(prepare(plan)) as runner:
        for run in range(episodes):
            one = job(plan, run)
            texts.append(unpacked(runner.play(one).outcome.trace))
            episode = play(runner.setup, runner.agents_of(one), one.seed, record=True)
            actions = by_body(runner.setup, episode.actions)
            spent += min(
                seconds(lambda: trace_text({}, frames_text(episode.frames, actions)))  # noqa: B023
                for _ in range(rounds)
            )
    return texts, 1e3 * spent / episodes


def read(data: bytes) -> str:
    """The text of a trace file."""
    return unpacked(data)


def by_level(level: int, text: str) -> bytes:
    """A trace compressed by a level of zlib."""
    packer = zlib.compressobj(level, zlib.DEFLATED, GZIP)
    return packer.compress(text.encode("utf-8")) + packer.flush()


def mean_ms(call: Callable[[Any], Any], given: list[Any], rounds: int) -> float:
    """How long a call takes on each of some values [ms]."""
    best = [min(seconds(partial(call, one)) for _ in range(rounds)) for one in given]
    return 1e3 * sum(best) / len(best)


def seconds(call: Callable[[], Any]) -> float:
    """CPU time of a call [s]."""
    begun = time.thread_time()
    call()
    return time.thread_time() - begun


if __name__ == "__main__":
    main()
