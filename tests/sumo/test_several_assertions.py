"""Several assertions in one batch: parameters, the row, the summary and JUnit."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cavsumo.assertions import ASSERTIONS, Judgement, make_assertions
from cavsumo.assertions.base import HELD, NOT_TRIGGERED, UNFAIR, VIOLATED, weightiest
from cavsumo.batch.tally import Tally
from cavsumo.cli import main
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.scenario import plan_from
from cavsumo.model.scenario_file import read_config
from cavsumo.results.columns import verdicts_cell
from cavsumo.results.reading import read_rows
from cavsumo.results.rows import verdicts_of

NAMES = ("reaction-zone", "stopping-distance", "speed-limit")


def test_parameters_are_shared_or_of_one() -> None:
    """KEY for all that have it, NAME.KEY for one; what none has is refused."""
    made = make_assertions(
        ("stopping-distance", "two-second-gap", "rss"), {"wet": True, "rss.rho": 0.5}, {}, 0.1
    )
    stopping, gap, rss = (vars(a) for a in made)
    assert (stopping["factor"], gap["gap_s"], rss["rho"]) == (2.0, 4.0, 0.5)
    with pytest.raises(UnknownName, match=r"'roh'.*did you mean 'rho'"):
        make_assertions(("rss", "ttc"), {"roh": 1.0}, {}, 0.1)
    with pytest.raises(UnknownName, match=r"'rss\.roh'.*did you mean 'rss\.rho'"):
        make_assertions(("rss", "ttc"), {"rss.roh": 1.0}, {}, 0.1)
    with pytest.raises(UnknownName):
        make_assertions(("ttc",), {"rss.rho": 1.0}, {}, 0.1)
    with pytest.raises(InputError, match="'ttc' is named twice"):
        make_assertions(("ttc", "rss", "ttc"), {}, {}, 0.1)


def test_the_scenario_file_sets_them_alike(tmp_path: Path, networks: dict[str, Path]) -> None:
    """As dotted keys of TOML, which make a table, or as quoted ones."""
    file = tmp_path / "scenario.toml"
    text = f'net = "{networks["pedestrians"]}"\nassertions = ["rss"]\n[assertion_params]\n'
    for line in ("rss.rho = 0.5", '"rss.rho" = 0.5'):
        file.write_text(text + line + "\n", encoding="utf-8")
        plan = plan_from(read_config(file), str(file))
        assert plan.scenario.assertion_params == {"rss.rho": 0.5}


def verdict_of(**verdicts: str) -> Judgement:
    """What stands for an episode in which assertions said this."""
    made = make_assertions([name.replace("_", "-") for name in verdicts], {}, {}, 0.1)
    for i, (assertion, verdict) in enumerate(zip(made, verdicts.values(), strict=True)):
        when = None if verdict == NOT_TRIGGERED else 5.0 - i
        assertion.judgement = Judgement(assertion.name, verdict, trigger_time=when)
    return weightiest(made)


def test_who_speaks_for_an_episode() -> None:
    """The most serious, then the earliest; one without precondition if violated or alone."""
    assert verdict_of(ttc=HELD, rss=VIOLATED).assertion == "rss"
    assert verdict_of(ttc=HELD, drac=HELD).assertion == "drac"
    assert verdict_of(ttc=NOT_TRIGGERED, speed_limit=HELD).verdict == NOT_TRIGGERED
    assert verdict_of(ttc=HELD, speed_limit=VIOLATED).assertion == "speed-limit"
    assert verdict_of(reaction_zone=UNFAIR, collision=HELD).verdict == UNFAIR
    assert verdict_of(speed_limit=HELD, collision=HELD).verdict == HELD


def test_verdicts_as_a_cell() -> None:
    """They come back as they went in; an old row has none."""
    said = {"a": HELD, "module:f=g": VIOLATED}
    assert verdicts_of({"verdicts": verdicts_cell(said)}) == said
    assert verdicts_of({}) == {}


def test_a_batch(
    tmp_path: Path,
    networks: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Rows, summary, report and replay know all of them."""
    monkeypatch.chdir(tmp_path)
    words = [word for name in NAMES for word in ("--assert", name)]
    words += ["--assert-param", "speed-limit.share=0", "--runs", "6", "--exit-zero", "-q"]
    net = str(networks["pedestrians"])
    assert main(["run", "-n", net, "-r", "none", "--ego", "constant", *words]) == 0
    rows = list(read_rows(Path("results.csv")))
    tally = Tally()
    for row in rows:
        tally.add(row)
        verdicts = verdicts_of(row)
        assert tuple(verdicts) == NAMES
        if row["assertion"]:
            assert verdicts[row["assertion"]] == row["outcome"]
        if row["outcome"] == VIOLATED:
            assert row["reference"] == "human"
            assert row["avoidable"] in ("0", "1"), row["avoidable_note"]
        if row["robustness"]:
            assert (float(row["robustness"]) < 0.0) == (row["outcome"] == VIOLATED)
    counted = tally.agents["timing"].verdicts
    assert {name: sum(said.values()) for name, said in counted.items()} == dict.fromkeys(NAMES, 6)
    assert counted["stopping-distance"][VIOLATED] > 0
    assert any(row["min_ttc_s"] for row in rows)
    assert all(float(row["max_drac_mps2"] or 0.0) >= 0.0 for row in rows)
    assert main(["report", "results.csv", "--junit", "junit.xml"]) == 0
    cases = {case.get("name"): case for case in ElementTree.parse("junit.xml").iter("testcase")}
    assert set(cases) == set(NAMES)
    failed = cases["stopping-distance"].find("failure")
    assert failed is not None
    own = [row for row in rows if row["assertion"] == "stopping-distance"]
    preventable = sum(row["avoidable"] == "1" for row in own)
    said = str(failed.get("message"))
    assert re.match(rf"{preventable} failures? of \d+ tests preventable by a careful human", said)
    not_judged = counted["stopping-distance"][VIOLATED] - len(own)
    assert (f"{not_judged} not judged" in said) == (not_judged > 0)
    assert main(["replay", "results.csv", "0"]) in (0, 1)
    capsys.readouterr()
    assert main(["run", "-n", net, "-r", "none", *words[:-1], "--overwrite"]) == 0
    said = capsys.readouterr().out
    assert "violated" in said
    assert all(name in said for name in NAMES)


def test_the_listing_says_where_each_comes_from() -> None:
    """One line each, with its source or rule, and a unit."""
    for name in ASSERTIONS:
        assert len(ASSERTIONS.summary(name)) < 100
        assert ASSERTIONS.make(name, {}).unit
        assert all(p.doc for p in ASSERTIONS.parameters(name))
