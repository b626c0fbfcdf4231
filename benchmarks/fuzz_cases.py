"""Cases for the fuzz: commands with a damaged file each, derived from whole ones."""

from __future__ import annotations

import contextlib
import dataclasses
import gzip
import io
import json
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_inputs import json_lines, jsons, tables, tomls, xmls
from hypothesis import strategies as st

from cavsumo.batch.episode_runner import EpisodeRunner
from cavsumo.batch.jobs import job
from cavsumo.batch.prepared import manifest, prepare
from cavsumo.model.scenario import plan_from
from cavsumo.results.trace_file import unpacked
from cavsumo.results.writing import Recorder

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Case:
    """A command in a folder: its words, and the files that are put there before."""

    words: tuple[str, ...]
    files: Mapping[str, bytes]
    simulated: bool = False  # SUMO loads it too, in a process of its own


@dataclass(frozen=True)
class Whole:
    """Whole files that cases are derived from: their contents by name."""

    files: Mapping[str, bytes]

    def text(self, name: str) -> str:
        """A file as text."""
        return self.files[name].decode()

    def trace(self, name: str) -> str:
        """The text of a trace."""
        return unpacked(self.files[name])

    def tree(self, name: str) -> Any:
        """A JSON file as a document."""
        return json.loads(self.files[name])


def whole_files() -> Whole:
    """A small batch on the straight road with traces, a network, an extract, a game, a policy."""
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path()
        shutil.copy(ROOT / "networks" / "pedestrians.net.xml", "road.net.xml")
        shutil.copy(ROOT / "networks" / "junction.net.xml", "junction.net.xml")
        shutil.copy(ROOT / "routes" / "pedestrians.rou.xml", "road.rou.xml")
        shutil.copy(ROOT / "tests" / "data" / "crossroads.osm", "cross.osm")
        _play(folder / "found.csv")
        cases = json.loads((ROOT / "tests" / "data" / "ssp_games.json").read_text())["cases"]
        game = min(
            (case for case in cases if case["n_states"] > 3 and "goal" in case),
            key=lambda c: len(str(c)),
        )
        (folder / "game.json").write_text(json.dumps(game))
        shutil.copy(ROOT / "examples" / "train_tester" / "tester.npz", "tester.npz")
        files = [f for f in folder.rglob("*") if f.is_file()]
        return Whole({str(f): f.read_bytes() for f in files})


def _play(csv_file: Path) -> None:
    """Three episodes of an ego that keeps its speed."""
    given = {"net": "road.net.xml", "routes": "none", "ego": "constant", "runs": 3, "end": 8.0}
    prepared = prepare(plan_from(given | {"trace": "all", "testers": 2, "seed": 3}, "fuzz"))
    with EpisodeRunner(prepared) as runner, Recorder(csv_file) as recorder:
        recorder.begin(manifest(prepared))
        for run in range(3):
            recorder.write(runner.play(job(prepared.plan, run)).outcome)
        recorder.finish("finished", {"episodes": 3, "counts": {}})


def strategies(whole: Whole, *, simulated: bool) -> dict[str, st.SearchStrategy[Case]]:
    """Cases of every sort; ``simulated``: SUMO loads those that only SUMO reads."""
    scenario = {
        "net": "road.net.xml",
        "routes": "road.rou.xml",
        "additional": [],
        "agents": ["timing", "a=random"],
        "runs": 2,
        "seed": 3,
        "ego": "time-gap",
        "ego_params": {"time_gap_s": 1.5},
        "params": {"a.between": "repeat"},
        "ego_sensor": {"range_m": 30.0},
        "testers": 2,
        "end": 8.0,
        "step_length": 0.1,
        "assertions": ["reaction-zone"],
        "assertion_params": {"max_decel": 8.0},
        "formulas": {"apart": "always (gap_m > 0.5)"},
        "shard": "1/2",
    }
    drawn = {k: v for k, v in scenario.items() if k not in ("routes", "shard", "formulas")}
    drawn |= {"traffic": [4.0, 2.0], "traffic_seed": 1, "ego_route": "straight", "kind": "bicycle"}
    vary = {
        "testers": [1, 3],
        "place": [{"name": "a", "net": "road.net.xml"}, {"name": "b", "end": 4}],
    }
    study = {"net": "road.net.xml", "runs": 2, "vary": vary}
    base = {k: v for k, v in whole.files.items()}
    lines = [json.loads(line) for line in whole.trace("found/run000000.jsonl.gz").splitlines()[:6]]
    road = "run -n road.net.xml --ego constant --end 3"
    net, osm = whole.text("road.net.xml"), whole.text("cross.osm")

    def case(name: str, data: Any, *words: str) -> st.SearchStrategy[Case]:
        commands = st.sampled_from([tuple(w.split()) for w in words])
        return st.builds(lambda d, c: Case(c, base | {name: d}), data, commands)

    return {
        "scenario": case("c.toml", tomls(scenario) | tomls(drawn), "run -c c.toml -q"),
        "study": case("c.toml", tomls(study), "run -c c.toml -q"),
        "manifest": case(
            "found.json",
            jsons(whole.tree("found.json")),
            "report found.csv",
            "report found.csv --format json --junit j.xml",
            "report found.csv --html p.html --replays 1",
            "merge found.csv -o whole.csv",
            "replay found.csv 1",
            "replay found.csv 1 --recorded --fcd f.xml",
            "run --resume -o found.csv -n road.net.xml",
            "run --retry-errors -o found.csv -n road.net.xml",
            "run -o found.csv -n road.net.xml",
            "certify found.csv 1",
        ),
        "rows": case(
            "found.csv",
            tables(whole.text("found.csv")),
            "report found.csv",
            "report found.csv --by ego --format csv --junit j.xml",
            "report found.csv --html p.html --replays 1",
            "merge found.csv -o whole.csv",
            "replay found.csv 1",
            "replay found.csv 1 --recorded --html p.html",
            "certify found.csv timing",
        ),
        "trace": case(
            "found/run000001.jsonl.gz",
            json_lines(lines)
            | json_lines(lines).map(gzip.compress)
            | torn(whole.files["found/run000001.jsonl.gz"]),
            "replay found/run000001.jsonl.gz",
            "replay found/run000001.jsonl.gz --recorded --html p.html",
            "replay found/run000001.jsonl.gz --recorded --fcd f.xml",
            "replay found.csv 1 --recorded --html p.html --fcd f.xml",
            "report found.csv --html p.html --replays 3",
            "merge found.csv -o whole.csv",
        ),
        "network": case(
            "road.net.xml",
            xmls(net),
            "inspect road.net.xml",
            "inspect road.net.xml --json",
            "run -n road.net.xml -r none -q",
            "run -n road.net.xml -r road.rou.xml --jaywalk --ego-route eastbound -q",
            "run -n road.net.xml --traffic 4 --kind car --agent random -q",
        ),
        "junction": case(
            "junction.net.xml",
            xmls(whole.text("junction.net.xml")),
            "inspect junction.net.xml",
            "run -n junction.net.xml -r none -q --ego-route left",
            "run -n junction.net.xml -r none -q --signal red",
            "run -n junction.net.xml --traffic 4 --kind car --agent random -q",
        ),
        "routes": case(
            "road.rou.xml",
            xmls(whole.text("road.rou.xml")),
            f"{road} -r road.rou.xml",
            f"{road} -a road.rou.xml -r none",
        ).map(lambda one: dataclasses.replace(one, simulated=simulated)),
        "extract": case("cross.osm", xmls(osm), "import-osm cross.osm -o made.net.xml"),
        "game": case("game.json", jsons(whole.tree("game.json")), "game solve game.json --json"),
        "policy": case(
            "tester.npz",
            policies(whole.files["tester.npz"]),
            "agents policy:tester.npz",
            "run --agent policy:tester.npz -n road.net.xml",
        ),
        "words": command_lines().map(lambda words: Case(words, base)),
        "reply": replies().map(lambda line: Case(("reply",), {"line": line})),
    }


@st.composite
def policies(draw: Any, whole: bytes) -> bytes:
    """A policy file with its header or one of its arrays damaged, or its bytes."""
    arrays = dict(np.load(io.BytesIO(whole)))
    header = draw(jsons(json.loads(str(arrays["header"])))).decode("utf-8", "replace")
    if draw(st.booleans()):
        arrays["header"] = np.array(header[:20000])
    else:
        name = draw(st.sampled_from(sorted(arrays)))
        odd: list[Any] = [np.zeros(0), np.zeros((2, 2, 2)), np.full(3, np.nan), np.array("x")]
        odd += [np.array(5), arrays[name][:1] if arrays[name].ndim else np.array([1j])]
        odd += [np.array([b"x"]), np.array(["2020"], dtype="datetime64[Y]"), np.ones(3, bool)]
        arrays[name] = odd[draw(st.integers(0, len(odd) - 1))]
        if draw(st.integers(0, 4)) == 0:
            del arrays[draw(st.sampled_from(sorted(arrays)))]
    file = io.BytesIO()
    np.savez(file, **arrays)
    data = file.getvalue()
    return draw(torn(data)) if draw(st.integers(0, 4)) == 0 else data


@st.composite
def torn(draw: Any, data: bytes) -> bytes:
    """Bytes that end too early, or of which two are others."""
    at = draw(st.integers(0, len(data) - 1))
    return data[:at] if draw(st.booleans()) else data[:at] + b"\xff\x00" + data[at + 2 :]


WORDS = (
    *("0", "-1", "1", "nan", "inf", "1e999", "9" * 400, "", " ", "x", "x" * 300, "../x", ".", "/"),
    *(
        "found.csv",
        "found.json",
        "found/run000001.jsonl.gz",
        "road.net.xml",
        "cross.osm",
        "game.json",
    ),
    *(
        "a=1",
        "a=",
        "=",
        "x=nan",
        "range_m=nan",
        "a=always (",
        "a=" + "(" * 3000,
        "always",
        "\udcff",
    ),
    *(
        "timing",
        "random",
        "a=timing",
        "policy:x",
        "policy:" + "x" * 300,
        "no:Such",
        "exec:",
        "tcp:",
    ),
    *(
        "exec:'",
        "tcp:x:99999",
        "tcp:[:1",
        "straight",
        "eastbound",
        "red",
        "bus",
        "crossing",
        "none",
    ),
    *("1/2", "0/0", "²/²", "10%", "4,2", "4,,2", "1,2,3,4", "nan,1,2,3", "٣", "c\u0000d", "\n"),
)
COMMANDS = (
    *("run", "run", "run", "replay", "report", "merge", "certify", "check-ego", "inspect"),
    *("import-osm", "game solve", "agents", "egos", "assertions", ""),
)
OPTIONS = (
    *(
        "-n -r --traffic -a -c --ego --ego-param --ego-sensor --ego-route --junction --signal"
    ).split(),
    *(
        "--assert --assert-param --formula --reference --agent --testers --param --kind --jaywalk"
    ).split(),
    *(
        "--tester-sensor --approach --bodies-per-agent --sumo-width --start-speed --runs --seed"
    ).split(),
    *("-e --step-length --deadline --reset -j --shard -x --until-tests --until-half-width").split(),
    *("--until-rate --budget -o --trace --resume --retry-errors --overwrite --by --format").split(),
    *(
        "--junit --html --replays --recorded --trust --fcd --top --json --picture --bbox --zebra"
    ).split(),
    *("--trim --reading --apart --level --egos --help --version -q --zzz -").split(),
)


@st.composite
def command_lines(draw: Any) -> tuple[str, ...]:
    """A command with words and options, some of which it has."""
    words = draw(st.sampled_from(COMMANDS)).split()
    word = st.sampled_from(WORDS)
    words += draw(st.lists(word, max_size=2))
    for _ in range(draw(st.integers(0, 4))):
        words.append(draw(st.sampled_from(OPTIONS)))
        words += draw(st.lists(word, max_size=1))
    return tuple(words)


def replies() -> st.SearchStrategy[bytes]:
    """Lines that an ego may answer."""
    whole = (
        {"type": "hello", "version": 1},
        {"type": "ready"},
        {"acceleration": 0.5, "step": 3},
        {"throttle": 0.5, "steering": -0.1},
        {"error": "no"},
    )
    return st.one_of(*map(jsons, whole)) | st.binary(max_size=40)
