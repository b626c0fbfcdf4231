"""Networks by name: in a checkout and the wheel, beside paths, in results, in replays elsewhere."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from support import ROOT, content

from cavsumo.batch.located import located
from cavsumo.batch.replay import recorded_alone
from cavsumo.cli import main
from cavsumo.errors import InputError, UnknownName
from cavsumo.model import named_networks
from cavsumo.model.scenario import plan_from
from cavsumo.model.scenario_file import read_config
from cavsumo.results.trace_file import read_trace_text, unpacked

FEW = ("--runs", "3", "--trace", "all", "--end", "12", "-q", "--exit-zero")


@pytest.fixture
def away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder without networks."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def without_place(folder: Path, *places: str) -> dict[str, str]:
    """The results and traces in a folder, with all that a plan says of places taken out."""
    found = {}
    for name, data in content(folder).items():
        if name == "results.json" or "/inputs/" in name:
            continue
        text = unpacked(data)
        for place in sorted(places, key=len, reverse=True):
            text = text.replace(json.dumps(place), '"PLACE"')
        if name.endswith(".csv"):  # without the real time
            text = "\n".join(line.rpartition(",")[0] for line in text.splitlines())
        found[name] = text
    return found


def test_a_name_plays_what_its_path_plays(
    away: Path, networks: dict[str, Path], routes: dict[str, Path]
) -> None:
    """The same rows and traces, but for the places of network and routes."""
    for folder, net in (("name", "crossing"), ("path", str(networks["crossing"]))):
        (away / folder).mkdir()
        assert main(["run", "--net", net, *FEW, "-o", f"{folder}/results.csv"]) == 0
    places = ["crossing", "cavsumo/data/routes/crossing.rou.xml"]
    places += [str(networks["crossing"]), str(routes["crossing"])]
    found = [without_place(away / folder, *places) for folder in ("name", "path")]
    assert len(found[0]) == 4
    assert found[0] == found[1]


def test_routes_have_the_names_of_their_networks(
    away: Path, networks: dict[str, Path], routes: dict[str, Path]
) -> None:
    """On the command line, in scenario files, in Python and for a replay; a file goes before."""
    net = str(networks["crossing"])
    named = plan_from({"net": net, "routes": "crossing"}, "here").scenario
    assert named.routes == plan_from({"net": "crossing"}, "here").scenario.routes
    assert named.routes_file == routes["crossing"]
    (away / "sub").mkdir()
    (away / "sub" / "c.toml").write_text(f'net = "{net}"\nroutes = "crossing"\n')
    assert plan_from(read_config(Path("sub/c.toml")), "here").scenario == named
    assert main(["run", "-n", net, "-r", "crossing", *FEW, "-o", "results.csv"]) == 0
    shutil.rmtree(away / "results" / "inputs")
    again = ["replay", "results.csv", "0", "--net", "crossing", "--routes"]
    assert main([*again, "crossing"]) == 0
    assert main([*again, "junction"]) == 2
    with pytest.raises(UnknownName, match="unknown routes 'crosing'; did you mean 'crossing'"):
        plan_from({"net": net, "routes": "crosing"}, "here")
    Path("crossing").write_text("<routes/>")
    assert plan_from({"net": net, "routes": "crossing"}, "here").scenario.routes == Path("crossing")


def test_a_recorded_name_is_found_again_anywhere(
    away: Path, monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Results and a lone trace hold no place of this machine, and are replayed by the name."""
    assert main(["run", "--net", "junction", *FEW, "-o", "results.csv"]) == 0
    trace = next((away / "results").glob("*.jsonl.gz"))
    texts = [read_trace_text(trace), (away / "results.json").read_text()]
    assert not [text for text in texts if str(ROOT) in text]
    other = tmp_path_factory.mktemp("elsewhere")
    shutil.copytree(away, other, dirs_exist_ok=True)
    monkeypatch.chdir(other)
    assert main(["replay", "results.csv", "0"]) == 0
    shutil.copy(trace, other / "sent.jsonl.gz")
    assert main(["replay", "sent.jsonl.gz"]) == 0
    assert main(["replay", "sent.jsonl.gz", "--net", "junction"]) == 0
    assert main(["run", "--net", "junction", *FEW, "-o", "results.csv", "--resume"]) == 0
    assert main(["run", "--resume", "-q", "--exit-zero"]) == 0  # of what was recorded, no default


def test_another_network_of_the_same_name_is_refused_in_a_replay(
    away: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By its checksum; the one recorded may be kept with the trace, or lie beside it."""
    words = [*FEW, "--runs", "1"]
    assert main(["run", "--net", "pedestrians", *words, "-o", "results.csv"]) == 0
    trace = next((away / "results").glob("*.jsonl.gz"))
    changed = away / "package"
    for folder in ("networks", "routes"):
        shutil.copytree(ROOT / folder, changed / folder)
    net = changed / "networks" / "pedestrians.net.xml"
    net.write_text(net.read_text() + "<!-- changed -->\n")
    monkeypatch.setattr(named_networks, "_folder", lambda sort: changed / sort)
    assert located(recorded_alone(trace)).plan.scenario.net_file.name == "pedestrians.net.xml"
    shutil.rmtree(trace.parent / "inputs")
    with pytest.raises(InputError, match=r"not the 'pedestrians\.net\.xml' \(sha256"):
        located(recorded_alone(trace), None, None)
    shutil.copy(ROOT / "networks" / "pedestrians.net.xml", trace.parent)
    found = located(recorded_alone(trace), None, None).plan.scenario
    assert found.net_file == trace.parent / "pedestrians.net.xml"


def test_a_file_goes_before_a_name_and_a_folder_does_not(
    away: Path, networks: dict[str, Path]
) -> None:
    """The traces of crossing.csv lie in a folder ``crossing``."""
    (away / "crossing").mkdir()
    plan = plan_from({"net": "crossing"}, "test").scenario
    assert plan.net_file == networks["crossing"]
    (away / "crossing").rmdir()
    shutil.copy(networks["pedestrians"], away / "crossing")
    plan = plan_from({"net": "crossing"}, "test").scenario
    assert (plan.net_file, plan.routes) == (Path("crossing"), None)


@pytest.mark.parametrize(
    "words",
    [
        "run --net crosing", "inspect crosing", "check-ego constant --net crosing",
        "replay {trace} --net crosing", "run -c scenario.toml",
    ],
)  # fmt: skip
def test_an_unknown_name_is_one_sentence(
    words: str, away: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With the nearest name, exit status 2, and nothing written."""
    (away / "scenario.toml").write_text('net = "crosing"\n')
    if "{trace}" in words:
        assert main(["run", "--net", "pedestrians", *FEW, "--runs", "1", "-o", "a.csv"]) == 0
        words = words.format(trace=next((away / "a").glob("*.jsonl.gz")))
    before = content(away)
    assert main(words.split()) == 2
    said = capsys.readouterr().err
    assert said.endswith("unknown network 'crosing'; did you mean 'crossing'?\n")
    assert said.count("\n") == 1
    assert content(away) == before


def test_a_name_that_resembles_none_lists_them(away: Path) -> None:
    """There are few."""
    with pytest.raises(UnknownName, match="valid: crossing, junction, pedestrians"):
        plan_from({"net": "zzz"}, "test")


@pytest.mark.parametrize("words", ["inspect pedestrians", "check-ego constant --net pedestrians"])
def test_other_commands_take_names(
    words: str, away: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Wherever they are called."""
    assert main(words.split()) == 0
    assert "FAIL" not in capsys.readouterr().out


def test_a_scenario_file_has_names_and_its_own_files(
    away: Path, networks: dict[str, Path], write_scenario: Callable[[str], Path]
) -> None:
    """A file beside it goes before a name; a path stays one."""
    assert read_config(write_scenario("crossing"))["net"] == "crossing"
    assert read_config(write_scenario("my.net.xml"))["net"] == str(away / "s" / "my.net.xml")
    shutil.copy(networks["pedestrians"], away / "s" / "crossing")
    assert read_config(write_scenario("crossing"))["net"] == str(away / "s" / "crossing")


@pytest.fixture
def write_scenario(away: Path) -> Callable[[str], Path]:
    """Call with a network for a scenario file in another folder."""

    def write(net: str) -> Path:
        (away / "s").mkdir(exist_ok=True)
        file = away / "s" / "scenario.toml"
        file.write_text(f'net = "{net}"\n')
        return file

    return write


def test_a_scenario_file_still_says_where_it_plays(
    away: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One without a network is not played somewhere else."""
    (away / "scenario.toml").write_text("runs = 1\n")
    assert main(["run", "-c", "scenario.toml"]) == 2
    assert "no network given" in capsys.readouterr().err


def test_a_run_by_name_is_shown_without_playing_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report's pages and a recorded replay find the network by its name, anywhere."""
    monkeypatch.chdir(tmp_path)
    words = ["--runs", "2", "--trace", "all", "-o", "found.csv", "-q", "--exit-zero"]
    assert main(["run", "--net", "crossing", *words]) == 0
    assert main(["replay", "found.csv", "0", "--recorded", "--html", "run0.html"]) == 0
    assert main(["report", "found.csv", "--html", "report.html"]) == 0
    assert "OpenStreetMap" in (tmp_path / "report.html").read_text(encoding="utf-8")
