"""README and guide keep their word: their commands exist and their examples run."""

from __future__ import annotations

import itertools
import re
import shlex
import shutil
from pathlib import Path

import pytest
from inline import cavsumo
from support import ROOT

from cavsumo.batch.preflight import Manner, checked
from cavsumo.cli.command_line import _parser
from cavsumo.cli.scenario_settings import parts_of

FILES = ("README.md", "docs/guide.md")
README = "\n".join((ROOT / file).read_text(encoding="utf-8") for file in FILES)
REPORTS = sorted(set(re.findall(r"^cavsumo report [^`\n]*", README, re.MULTILINE)))
COMMANDS = sorted(set(re.findall(r"cavsumo run [^`\n]*", README)))
FIRST = (ROOT / "README.md").read_text(encoding="utf-8")
AGAIN = ("--help", "--resume", "--retry-errors")
PLAYED = [c for c in COMMANDS if c in FIRST or set(AGAIN) & set(c.split())]


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as the README's reader has it, with the files that the README shows."""
    folder = tmp_path_factory.mktemp("checkout")
    for name in ("networks", "routes", "examples"):
        (folder / name).symlink_to(ROOT / name)
    examples = re.findall(r"<!-- example: (\S+) -->\n```python\n(.*?)```", README, re.DOTALL)
    scenarios = re.findall(r"```toml\n(# (\S+):.*?)```", README, re.DOTALL)
    assert examples
    assert len(scenarios) == 2
    for name, source in examples:
        (folder / name).write_text(source, encoding="utf-8")
    for text, name in scenarios:
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "my.net.xml").symlink_to(ROOT / "networks" / "pedestrians.net.xml")
    first = ["run", "--net", "my.net.xml", "-r", "none", "--runs", "1", "--end", "1"]
    cavsumo(folder, *first, "-o", "results.csv")
    return folder


@pytest.mark.parametrize("command", PLAYED)
def test_each_run_command_of_the_readme_runs(command: str, checkout: Path) -> None:
    """Whatever the README tells the reader to type plays episodes."""
    words = shlex.split(command, comments=True)[1:]
    if "--scheduler" in words:
        pytest.skip("there is no cluster of that name; test_executors.py has one")
    if "tcp:127.0.0.1:5000" in words:
        pytest.skip("nobody listens there; test_external_egos.py has the server")
    if not set(AGAIN) & set(words):
        words += ["--runs", "1", "-o", "readme.csv", "--overwrite"]
    done = cavsumo(checkout, *words)
    assert done.returncode in (0, 1), done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("command", [c for c in COMMANDS if c not in PLAYED])
def test_each_run_command_of_the_guide_is_valid(
    command: str, checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its options are accepted, its agents and egos made, and its network has room for the test."""
    monkeypatch.chdir(checkout)
    monkeypatch.syspath_prepend(str(checkout))
    options = _parser().parse_args(shlex.split(command, comments=True)[1:])
    assert checked(parts_of(options), Path("guide.csv"), Manner())


@pytest.mark.parametrize("command", REPORTS)
def test_each_report_of_the_readme_is_written(command: str, checkout: Path) -> None:
    """The files it names are read, those after -o and --junit written."""
    words = shlex.split(command, comments=True)[1:]
    for name in words:
        if name.endswith(".csv") and name != "results.csv":
            shutil.copy(checkout / "results.csv", checkout / name)
            shutil.copy(checkout / "results.json", checkout / f"{Path(name).stem}.json")
    done = cavsumo(checkout, *words)
    assert done.returncode == 0
    for option, file in itertools.pairwise(words):
        if option in ("-o", "--junit", "--html"):
            assert (checkout / file).stat().st_size > 0
            assert f"cavsumo: wrote {file}\n" in done.stderr


@pytest.mark.parametrize("file", FILES)
def test_links_lead_somewhere(file: str) -> None:
    """To files and sections that exist."""
    here = ROOT / file
    for target in re.findall(r"\]\(([^)\s]+)\)", here.read_text(encoding="utf-8")):
        if target.startswith("http"):
            continue
        name, _, section = target.partition("#")
        there = (here.parent / name).resolve() if name else here
        assert there.exists(), target
        if section:
            headings = re.findall(r"^#+ (.*)$", there.read_text(encoding="utf-8"), re.MULTILINE)
            assert section in {h.lower().replace(" ", "-") for h in headings}, target


def test_the_agents_of_the_readme_are_those_that_there_are(checkout: Path) -> None:
    """The README's table of testers names every agent that is listed."""
    listed = {line.split()[0] for line in cavsumo(checkout, "agents").stdout.splitlines()}
    assert listed == set(re.findall(r"^\| `([a-z][a-z-]*|policy:FILE)` \|", README, re.MULTILINE))
