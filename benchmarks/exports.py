"""Exports of failures: valid, as recorded in another player, and the same collision there.

Plays batches on several networks until each has failures enough, exports them as OpenSCENARIO with
OpenDRIVE (and as CommonRoad), and asks others:

* the checkers ``qc_openscenario`` and ``qc_opendrive`` (pip install asam-qc-openscenarioxml
  asam-qc-opendrive, in an environment of their own), which hold the schemas;
* esmini, a player of OpenSCENARIO: where is every body at every timestep, and who collides when?
* commonroad-io, in an environment of its own: do the occupancies of the same pair overlap first?

    python benchmarks/exports.py --failures 34 --net crossing --net junction --net FILE.net.xml \\
        --esmini esmini --checkers VENV/bin --commonroad VENV/bin/python
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import cavsumo
from cavsumo.cli import main as command
from cavsumo.interop.tracks import at_axle, stays
from cavsumo.results.traces import Trace, read_trace

KINDS = ("pedestrian", "car")
CHECKERS = {
    "test.xosc": ("qc_openscenario", "xoscBundle"),
    "test.xodr": ("qc_opendrive", "xodrBundle"),
}
CONFIGURATION = """<Config><Param name="InputFile" value="{file}"/>
<CheckerBundle application="{bundle}"><Param name="resultFile" value="{result}"/></CheckerBundle>
</Config>"""
ESMINI = "--osc test.xosc --headless --fixed_timestep 0.01 --csv_logger out.csv --collision"
ESMINI_MORE = "--traj_filter 0 --logfile_path log.txt"
CELLS = {"x": 11, "y": 12, "heading": 24}  # behind the cell with the name of a body


@dataclass
class Found:
    """Results of one network and kind of tester.

    Attributes:
        exported: failures.
        issues: of the checkers: errors and warnings.
        compared: places compared.
        far, turned: the largest deviations [m], [rad].
        missing: bodies that are there in one and not in the other.
        same: exports in which the same pair collides within a timestep.
        tests: exports as tests in which the ego and the tester collide.
        commonroad: those in which commonroad-io finds the same collision.
    """

    exported: int = 0
    issues: int = 0
    compared: int = 0
    far: float = 0.0
    turned: float = 0.0
    missing: int = 0
    same: int = 0
    tests: int = 0
    commonroad: int = 0
    seen: list[str] = field(default_factory=list)


def main() -> None:
    """Print the table."""
    options = _parser().parse_args()
    print(f"{'':<36}{'failures':>9}{'issues':>8}{'compared':>10}{'m':>9}{'rad':>9}{'missing':>9}"
          f"{'same pair':>11}{'as test':>9}{'commonroad':>12}")  # fmt: skip
    with TemporaryDirectory() as folder:
        for net in options.net or ["crossing", "junction", "pedestrians"]:
            for kind in KINDS:
                found = _measured(net, kind, options, Path(folder))
                print(
                    _line(f"{Path(net).name.removesuffix('.net.xml')}, {kind}", found), flush=True
                )
                print(*found.seen, sep="\n", end="\n" if found.seen else "")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--failures", type=int, default=17, help="of each network and kind")
    parser.add_argument("--runs", type=int, default=60, help="episodes of each")
    parser.add_argument("--net", action="append", help="default: crossing, junction, pedestrians")
    parser.add_argument("--traffic", default="4", help="drawn background")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--esmini", default=shutil.which("esmini"), help="the player")
    parser.add_argument("--checkers", type=Path, help="the folder with qc_openscenario")
    parser.add_argument("--commonroad", help="a Python with commonroad-io and shapely")
    return parser


def _measured(net: str, kind: str, options: argparse.Namespace, folder: Path) -> Found:
    """The failures of one network and kind, exported and played."""
    file = folder / f"{Path(net).name}-{kind}.csv"
    results = cavsumo.run(
        net, kind=kind, agents=["timing"], ego="constant", traffic=options.traffic,
        runs=options.runs, seed=options.seed, output=file, progress=False,
    )  # fmt: skip
    found = Found()
    for run in results.failures["run"].head(options.failures):
        one = folder / f"{file.stem}-{run}"
        found.exported += 1
        trace = read_trace(folder / file.stem / f"run{run:06d}.jsonl.gz")
        for way in ("recorded", "test"):
            _export(file, run, "openscenario", one / way, way)
            found.issues += issues(one / way, options.checkers, found.seen)
        if options.esmini:
            add(found, trace, one, options.esmini)
        if options.commonroad:
            _export(file, run, "commonroad", one / "commonroad")
            said = asked_commonroad(options.commonroad, one / "commonroad" / "test.xml")
            found.commonroad += same_collision(said, trace)
    return found


def _export(file: Path, run: int, to: str, folder: Path, way: str = "recorded") -> None:
    """Export an episode into a new folder."""
    folder.mkdir(parents=True)
    words = ["export", str(file), str(run), "--to", to, "-o", str(folder)]
    if command([*words, *(["--as", way] if way != "recorded" else [])]) != 0:
        sys.exit(f"run {run} of {file.name} was not exported")


def issues(folder: Path, checkers: Path | None, seen: list[str]) -> int:
    """How many errors and warnings the checkers name."""
    if checkers is None:
        return 0
    found = 0
    for name, (program, bundle) in CHECKERS.items():
        file, settings, result = folder / name, folder / "settings.xml", folder / f"{name}.xqar"
        settings.write_text(CONFIGURATION.format(file=file, bundle=bundle, result=result), "utf-8")
        subprocess.run([checkers / program, "-c", settings], check=True, capture_output=True)
        text = result.read_text("utf-8")
        named = re.findall(r'ruleUID="([^"]+)"', text.partition("<Issue ")[2])
        seen += [f"  {folder.parent.name} {name}: {rule}" for rule in sorted({*named})]
        found += text.count("<Issue ")
    return found


def add(found: Found, trace: Trace, folder: Path, esmini: str) -> None:
    """Play an export as recorded and as a test, and add what is seen."""
    far, turned, compared, missing = deviations(trace, play(folder / "recorded", esmini))
    found.far, found.turned = max(found.far, far), max(found.turned, turned)
    found.compared, found.missing = found.compared + compared, found.missing + missing
    tester, time = trace.row["tester"], float(trace.row["violation_time_s"])
    met = collisions(folder / "recorded").get(tester, math.inf)
    found.same += abs(met - time) <= step(trace) + 1e-6
    play(folder / "test", esmini)
    found.tests += tester in collisions(folder / "test")


Played = Mapping[int, Mapping[str, tuple[float, float, float]]]  # by hundredths of a second


def play(folder: Path, esmini: str) -> Played:
    """Play an export: where every body is, by the time in hundredths of a second."""
    words = [esmini, *ESMINI.split(), *ESMINI_MORE.split()]
    subprocess.run(words, cwd=folder, capture_output=True, timeout=200, check=True)
    east, north = _offset(folder / "test.xodr")
    return {time: {name: (x - east, y - north, o) for name, x, y, o in bodies}
            for time, bodies in _rows(folder / "out.csv")}  # fmt: skip


def _rows(file: Path) -> Iterator[tuple[int, list[tuple[str, float, float, float]]]]:
    """The rows of esmini's table."""
    with file.open(encoding="utf-8") as stream:
        for row in csv.reader(stream, skipinitialspace=True):
            if len(row) > max(CELLS.values()) and row[0].isdecimal():
                at = range(2, len(row) - max(CELLS.values()), 31)
                yield (
                    round(100 * float(row[1])),
                    [
                        (row[i].strip(), *(float(row[i + k]) for k in CELLS.values()))  # type: ignore[misc]
                        for i in at
                    ],
                )


def _offset(file: Path) -> tuple[float, float]:
    """The offset of the road's coordinates, which esmini adds in its output."""
    found = re.search(r'<offset x="([-\d.e+]+)" y="([-\d.e+]+)"', file.read_text("utf-8"))
    return (float(found[1]), float(found[2])) if found else (0.0, 0.0)


def deviations(trace: Trace, played: Played) -> tuple[float, float, int, int]:
    """The largest deviation in m and rad, the places compared, and those that are missing."""
    far = turned = 0.0
    compared = missing = 0
    for body in stays(trace):
        for track in body.tracks:
            for one in at_axle(body.shape, track):
                there = played.get(round(100 * one.time), {}).get(body.name)
                if there is None:
                    missing += 1
                    continue
                compared += 1
                far = max(far, math.dist(there[:2], (one.x, one.y)))
                turned = max(turned, abs(math.remainder(there[2] - one.heading, math.tau)))
    expected = {(round(100 * frame["time_s"]), name) for frame in trace.frames
                for name in ("ego", *frame["testers"], *frame["background"])}  # fmt: skip
    times = {time for time, _ in expected}
    more = {(time, name) for time in times for name in played.get(time, ())} - expected
    return far, turned, compared, missing + len(more)


def collisions(folder: Path) -> dict[str, float]:
    """When the ego first touches which body [s]."""
    text = (folder / "log.txt").read_text(encoding="utf-8")
    hits = re.findall(r"\[([\d.]+)\] \[warn\] Collision between (\S+) and (\S+)", text)
    found: dict[str, float] = {}
    for time, one, other in hits:
        if "ego" in (one, other):
            found.setdefault(other if one == "ego" else one, float(time))
    return found


def step(trace: Trace) -> float:
    """The length of a timestep [s]."""
    return float(trace.head["plan"]["scenario"]["step_length"])


ASK = """
import json, sys
from commonroad.common.file_reader import CommonRoadFileReader
from commonroad.common.util import Interval
scenario, problems = CommonRoadFileReader(sys.argv[1]).open()
ego = problems.planning_problem_dict
bodies = {o.obstacle_id: o for o in scenario.dynamic_obstacles}
"""


def asked_commonroad(python: str, file: Path) -> Sequence[tuple[str, float]]:
    """The bodies whose occupancies overlap that of the ego, with the time [s] at which first."""
    done = subprocess.run(
        [python, "-c", ASK, str(file)], capture_output=True, text=True, check=True
    )
    return [(str(name), float(time)) for name, time in json.loads(done.stdout)]


def same_collision(said: Sequence[tuple[str, float]], trace: Trace) -> bool:
    """Whether the first collision is that of the trace, within a timestep."""
    if not said:
        return False
    name, time = min(said, key=lambda one: one[1])
    right = abs(time - float(trace.row["violation_time_s"])) <= step(trace) + 1e-6
    return right and name == trace.row["tester"]


def _line(name: str, found: Found) -> str:
    """A row of the table."""
    return (
        f"{name:<36}{found.exported:>9}{found.issues:>8}{found.compared:>10}{found.far:>9.5f}"
        f"{found.turned:>9.5f}{found.missing:>9}{found.same:>11}{found.tests:>9}"
        f"{found.commonroad:>12}"
    )


if __name__ == "__main__":
    main()
