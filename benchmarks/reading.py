"""A large network read for the first time and again: derived, and found on disk.

    python benchmarks/reading.py [--net FILE] [--times N]

Processor time of deriving a site, in turns with finding it, in a folder that was empty before.
Without ``--net`` a grid of about 2,000 edges with
pavements and crossings.
"""

from __future__ import annotations

import argparse
import os
import pickle
import statistics
import tempfile
import time
from pathlib import Path
from unittest import mock

from episode_server import grid

from cavsumo.batch.prepared import prepare
from cavsumo.model.scenario import plan_from
from cavsumo.network import site_cache


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--net", help="a network")
    parser.add_argument("--times", type=int, default=3, help="repetitions, medians are shown")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        net = options.net or grid(Path(folder))
        plan = plan_from({"net": net, "routes": "none"}, "benchmark")
        spent: dict[str, list[float]] = {"first": [], "again": []}
        sites = set()
        prepare(plan_from({"net": "pedestrians"}, "benchmark"))  # imports
        with mock.patch.object(site_cache, "LARGE", 0):
            for i in range(options.times):
                cache = {"XDG_CACHE_HOME": f"{folder}/{i}"}
                with mock.patch.dict(os.environ, cache):
                    for times in spent.values():
                        before = time.process_time()
                        sites.add(pickle.dumps(prepare(plan).site))
                        times.append(time.process_time() - before)
        size = plan.scenario.net_file.stat().st_size / 1e6
        first, again = (statistics.median(times) for times in spent.values())
        print(f"{Path(net).name}, {size:.1f} MB: {first:.2f} s the first time, {again:.2f} s again "
              f"({first / again:.0f} times), {len(sites)} site")  # fmt: skip


if __name__ == "__main__":
    main()
