"""Studies: which batches a scenario file makes, and that each is the batch it would be alone."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from inline import cavsumo
from support import ROOT, content, rows, untold

from cavsumo.batch.prepared import prepare
from cavsumo.batch.summary import interval
from cavsumo.cli import main
from cavsumo.errors import InputError
from cavsumo.model.scenario import plan_from
from cavsumo.model.study import Choice, Part, overruled, product, read_study
from cavsumo.results.reading import read_manifest
from cavsumo.results.statistics import rate

Write = Callable[[str], Path]

# Two agents, one of them learning, on an empty road: two batches, quickly played.
STUDY = """
net = "{net}"
routes = "none"
agents = ["soon=timing", "q-learning"]
runs = 2
end = 6
trace = "all"
ego = "constant"
params = {{ "soon.aim" = 0.9 }}

[vary]
testers = [1, 2]
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Call with the text of a scenario file."""

    def written(text: str) -> Path:
        file = tmp_path / "study.toml"
        file.write_text(text, encoding="utf-8")
        return file

    return written


@pytest.fixture
def home(tmp_path: Path, networks: Mapping[str, Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a small study."""
    text = STUDY.format(net=networks["pedestrians"])
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Which batches there are --------------------------------------------------------------------------


def test_without_vary_a_file_is_one_batch(write: Write) -> None:
    """As it always was: the file's settings, overruled by those given."""
    file = write('net = "a.net.xml"\nruns = 3\nparams = { aim = 0.5, distance_m = 9 }\n')
    given = {"runs": 5, "params": {"aim": 0.9}}
    (part,) = read_study(file, given)
    assert part.settings == {
        "net": str(file.parent / "a.net.xml"),
        "runs": 5,
        "params": {"aim": 0.9, "distance_m": 9},
    }
    assert part.output(Path("out/a.csv")) == Path("out/a.csv")


def test_all_combinations_the_last_entry_changing_fastest(write: Write) -> None:
    """Tables with names and plain values; what a table says overrules the file, paths resolved."""
    file = write(
        """
        net = "a.net.xml"
        ego_params = { speed = 6, sigma = 0 }

        [vary]
        place = [
            { name = "here" }, { name = "b", net = "b.net.xml", ego_params = { speed = 7 } } ]
        testers = [1, 3]
        """.replace("[\n            {", "[{")
    )
    parts = read_study(file, {"seed": 4})
    found = [(p.name, Path(p.settings["net"]).name, p.settings["testers"]) for p in parts]
    assert found == [
        ("here-testers1", "a.net.xml", 1),
        ("here-testers3", "a.net.xml", 3),
        ("b-testers1", "b.net.xml", 1),
        ("b-testers3", "b.net.xml", 3),
    ]
    assert [p.settings["ego_params"]["speed"] for p in parts] == [6, 6, 7, 7]
    assert all(p.settings["ego_params"]["sigma"] == 0 for p in parts)
    assert all(p.settings["seed"] == 4 for p in parts)
    assert Path(parts[2].settings["net"]) == file.parent / "b.net.xml"
    assert parts[3].output(Path("out/agency.csv")) == Path("out/agency-b-testers3.csv")


@pytest.mark.parametrize(
    ("entry", "names"),
    [
        ("testers = [1, 30]", ["testers1", "testers30"]),
        ("sumo_width = [0.05, 0.6]", ["sumo_width0.05", "sumo_width0.6"]),
        ('signal = ["green", "red"]', ["signal-green", "signal-red"]),
        ("jaywalk = [true, false]", ["jaywalk-true", "jaywalk-false"]),
        ('net = ["x/a.net.xml", "b.net.xml.gz"]', ["net-a", "net-b"]),
        ('ego = ["constant", "my.egos:Brake"]', ["ego-constant", "ego-my.egos-Brake"]),
    ],
)
def test_batches_are_called_after_what_is_varied(
    entry: str, names: list[str], write: Write
) -> None:
    """Names that a file can have."""
    assert [part.name for part in read_study(write(f"[vary]\n{entry}\n"), {})] == names


def test_the_product_is_pure() -> None:
    """No choice at all is one batch; what is chosen leaves the settings alone."""
    settings = {"params": {"aim": 0.5}}
    assert product(settings, []) == [Part("", settings)]
    choices = [[Choice("a", {"params": {"aim": 1.0}}), Choice("b", {"params": {"idle": "kerb"}})]]
    assert [part.settings["params"] for part in product(settings, choices)] == [
        {"aim": 1.0},
        {"aim": 0.5, "idle": "kerb"},
    ]
    assert settings == {"params": {"aim": 0.5}}
    with pytest.raises(InputError, match="params: expected a table in the scenario file, got 3"):
        overruled({"params": 3}, {"params": {"aim": 1}})


# What is refused ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("vary = 3", "vary: expected a table of lists"),
        ("[vary]", "vary: expected a table of lists"),
        ("[vary]\ntesters = 3", "vary.testers: expected a list, got 3"),
        ("[vary]\ntesters = []", "vary.testers: expected a list, got []"),
        ("[vary]\ntester = [1, 3]", "unknown key 'tester'; did you mean 'testers'?"),
        ("[vary]\nplace = [{ net = 'a' }]", "vary.place: expected a name"),
        ("[vary]\nplace = [{ name = 'a/b' }]", "got 'a/b'"),
        ("[vary]\nplace = [{ name = 'a', nte = 'a' }]", "vary.place: unknown key 'nte'; did you"),
        ("[vary]\nego_params = [{ speed = 3 }]", "vary.ego_params: expected a name"),
        ("[vary]\nagents = [['noop']]", "vary.agents: expected numbers, words or truth values"),
        ("[vary]\ntesters = [1, 1]", "two batches have the name 'testers1'"),
        ("[vary]\na = [{ name = 'A' }, { name = 'a' }]", "two batches have the name 'a'"),
        (
            "[vary]\ntesters = [1]\na = [{ name = 'a', testers = 2 }]",
            "vary.a: varies testers, as vary.testers does",
        ),
        (f"[vary]\nseed = {list(range(1001))}", "1001 batches, at most 1000"),
        (f"[vary]\na = [{{ name = '{'x' * 101}' }}]", "more than 100 characters"),
        ("[vary]\nruns = [1, 2]", "vary.runs varies runs, which is given beside the file"),
    ],
)
def test_bad_tables_are_one_sentence_with_the_key(text: str, said: str, write: Write) -> None:
    """The file, the key, what was expected."""
    file = write(text)
    with pytest.raises(InputError) as caught:
        read_study(file, {"runs": 5})
    assert said in str(caught.value)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("testers = [1, 0]", "run: testers0: testers: "),
        ("testers = [1]\nego = ['constant', 'constnat']", "did you mean 'constant'?"),
        ("testers = [1]\nnet = ['a.net.xml']", "a.net.xml"),
    ],
)
def test_a_study_with_one_bad_batch_plays_none(
    more: str, said: str, home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Everything is checked before anything is written, and said in one sentence."""
    file = home / "study.toml"
    file.write_text(file.read_text().replace("testers = [1, 2]", more), encoding="utf-8")
    assert main(["run", "-c", "study.toml"]) == 2
    complaint = capsys.readouterr().err
    assert said in complaint
    assert complaint.count("\n") == 1
    assert [f.name for f in home.iterdir()] == ["study.toml"]


def test_an_unfinished_batch_is_not_overwritten_by_a_study(
    home: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither it nor what would come before it."""
    (home / "results-testers2.csv").write_text("mine\n", encoding="utf-8")
    assert main(["run", "-c", "study.toml"]) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert not (home / "results-testers1.csv").exists()
    assert (home / "results-testers2.csv").read_text() == "mine\n"


# What is played -----------------------------------------------------------------------------------


def test_a_study_is_its_batches(home: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Rows, traces and lessons are those of single batches; one table tells of all.

    Going on with it plays what is missing: a batch that is finished stays to the byte.
    """
    assert main(["run", "-c", "study.toml", "--exit-zero"]) == 0
    said = capsys.readouterr()
    table = [line.split() for line in said.out.splitlines()[:5]]
    assert [line[0] for line in table] == [
        "batch",
        "testers1",
        "q-learning",
        "testers2",
        "q-learning",
    ]
    assert (table[1][1], table[1][2]) == ("soon", "2")
    assert "in 8 episodes" in said.out
    assert "results-testers1.csv to results-testers2.csv (2 batches)" in said.out
    assert said.err.count("cavsumo: testers") == 2
    text = (home / "study.toml").read_text(encoding="utf-8")
    (home / "alone.toml").write_text("testers = 2\n" + text[: text.index("[vary]")])
    assert main(["run", "-c", "alone.toml", "-o", "alone.csv", "-q"]) in (0, 1)
    part, single = Path("results-testers2.csv"), Path("alone.csv")
    assert untold(rows(part)) == untold(rows(single))
    assert read_manifest(part)["learned"] == read_manifest(single)["learned"]
    assert len(list(part.with_suffix("").glob("*.jsonl.gz"))) == 4
    before = content(home)
    shutil.rmtree(home / "results-testers2")
    (home / "results-testers2.csv").unlink()
    (home / "results-testers2.json").unlink()
    assert main(["run", "-c", "study.toml", "--exit-zero", "-q", "--resume"]) == 0
    after = content(home)
    assert after["results-testers1.csv"] == before["results-testers1.csv"]
    assert after.keys() == before.keys()
    assert untold(rows(part)) == untold(rows(single))


def test_the_worst_of_a_study_is_its_exit_status(home: Path) -> None:
    """An error in one batch outweighs what the ego did in another."""
    (home / "breaks.py").write_text(
        "from cavsumo.egos import Acceleration\n"
        "class Breaks:\n"
        "    def act(self, snapshot):\n"
        "        return Acceleration(1 / (len(snapshot.testers) - 1))\n",
        encoding="utf-8",
    )
    file = home / "study.toml"
    text = file.read_text().replace('ego = "constant"', 'ego = "breaks:Breaks"')
    file.write_text(text.replace("runs = 2", "runs = 1"), encoding="utf-8")
    done = cavsumo(home, "run", "-c", "study.toml")
    assert done.returncode == 3
    assert "2 could not be run; run 0 of results-testers1.csv: " in done.stdout
    assert "Traceback" not in done.stderr


# The experiment of the repository -----------------------------------------------------------------


def test_the_experiment_can_be_played() -> None:
    """Nine batches of the testers named in its documentation; every one can be set up."""
    parts = read_study(ROOT / "experiments" / "agency.toml", {})
    assert [part.name for part in parts] == [
        f"{place}-testers{n}" for place in ("straight", "crossing", "junction") for n in (1, 3, 6)
    ]
    for part in parts:
        prepared = prepare(plan_from(part.settings, part.name))
        plan = prepared.plan
        assert (plan.runs, plan.trace) == (250, "none")
        assert plan.cast["nearest"] == "election"
        assert plan.agent_params("nearest", ["rule"])["rule"] == "unsigned"
        assert prepared.site.demand is None
        assert (plan.scenario.routes is None) == part.name.startswith("straight")


def test_the_page_of_the_experiment_says_what_its_table_says() -> None:
    """Every tester of every cell has its share with interval on the page, and none is missing."""
    folder = ROOT / "experiments"
    page = (folder / "README.md").read_text(encoding="utf-8").splitlines()
    with (folder / "agency.csv").open(encoding="utf-8", newline="") as stream:
        table = list(csv.DictReader(stream))
    assert len(table) == 9 * 7
    for row in table:
        assert int(row["errors"]) == 0
        count, total = int(row["tests"]), int(row["episodes"])
        (line,) = (x for x in page if x.startswith(f"| {row['place']} | {row['agent']} | **"))
        cell = line.split(" | ")[2 + (1, 3, 6).index(int(row["testers"]))]
        found = rate(count, total)
        assert cell.startswith(f"**{100 * count / total:.1f}** {interval(found)}; ")
