"""Settings: a field of the scenario record is offered everywhere, and nowhere described again."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Annotated, Any

import pytest
from pydantic import Field

from cavsumo import cli
from cavsumo.cli.command_line import _parser
from cavsumo.cli.scenario_settings import parts_of, settings_of
from cavsumo.cli.setting_options import add_setting, given
from cavsumo.cli.settings_table import keywords, tables
from cavsumo.envs.settings import KEYS
from cavsumo.errors import InputError
from cavsumo.model.scenario import BatchPlan, Scenario, check_keys, plan_from
from cavsumo.model.scenario.fields import Setting, settings
from cavsumo.model.scenario.option import Option
from cavsumo.model.scenario.sensor import Sensor

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "settings.md").read_text(encoding="utf-8")
# Fields that are no settings: the scenario, scripts and suites are records of their own, and what
# agents know is learned.
INNER = {"scenario", "known", "script", "suite"}
FIELDS = sorted({*Scenario.model_fields, *BatchPlan.model_fields} - INNER)
BY_KEY = {setting.key: setting for setting in settings()}


class Rainy(Scenario):
    """A scenario with settings of each sort more."""

    rain: Annotated[float, Option("weather", metavar="MM")] = Field(
        0.5, ge=0, description="rain, 100% of it [mm/h]"
    )
    fog: Annotated[bool, Option("weather")] = Field(False, description="whether there is fog")
    winds: Annotated[tuple[str, ...], Option("weather", ("-w", "--wind"), unset="calm")] = Field(
        (), description="winds that blow"
    )


def parsed(offered: tuple[Setting, ...], words: str) -> dict[str, Any]:
    """The settings that the words of a command line give."""
    parser = argparse.ArgumentParser()
    for setting in offered:
        add_setting(parser.add_argument, setting)
    return given(parser.parse_args(words.split()), offered)


@pytest.mark.parametrize("key", FIELDS)
def test_every_field_is_an_option_a_key_a_keyword_and_a_row_of_the_docs(
    key: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What stands in the record can be set, and is described, everywhere."""
    setting = BY_KEY[key]
    assert setting.description
    check_keys({key: None}, "file")
    with pytest.raises(SystemExit):
        cli.main(["run", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    assert all(name in shown for name in setting.names)
    assert " ".join(setting.description.split()[:4]) in shown
    assert (key in KEYS) == (key in Scenario.model_fields or key in ("seed", "params"))
    assert f"| `{key}` | `{setting.names[0]}`" in PAGE


def test_the_page_of_settings_has_the_generated_tables() -> None:
    """To mend it: python -m cavsumo.cli.settings_table."""
    assert tables(settings()) in PAGE
    assert keywords(settings()) in PAGE


def test_a_field_that_is_added_is_offered_without_further_ado() -> None:
    """Its option, help, key, keyword and row come from the field alone."""
    offered = settings([Rainy])
    rain, fog, winds = (s for s in offered if s.option.group == "weather")
    found = parsed(offered, "--rain 2.5 --no-fog -w north --wind east --net crossing")
    assert found == {"net": "crossing", "rain": 2.5, "fog": False, "winds": ["north", "east"]}
    assert Rainy(**found).winds == ("north", "east")
    assert (rain.environments, fog.names, winds.default) == (True, ("--fog",), ())
    parser = argparse.ArgumentParser()
    for setting in (rain, fog, winds):
        add_setting(parser.add_argument, setting)
    shown = " ".join(parser.format_help().split())
    assert "--rain MM rain, 100% of it [mm/h] (default 0.5)" in shown
    assert "winds that blow; repeat for several (default: calm)" in shown
    table = tables(offered)
    assert "| `rain` | `--rain` | `0.5` | rain, 100% of it [mm/h] |" in table
    assert "| `fog` | `--fog` | `false` | whether there is fog |" in table
    assert "| `winds` | `-w`, `--wind` | calm | winds that blow |" in table


WORDS: dict[str, tuple[str, Any]] = {
    "traffic": ("4,2", (4.0, 2.0)),
    "ego_route": ("left", ("left",)),
    "assertions": ("collision", ("collision",)),
    "agents": ("noop", ("noop",)),
    "kind": ("car", "car"),
    "reference": ("ideal", "ideal"),
    "shard": ("1/2", "1/2"),
    "until_half_width": ("10%", "10%"),
    "step_length": ("0.2", 0.2),
    "formulas": ("calm=always (gap_m > 0)", {"calm": "always (gap_m > 0)"}),
    "net": ("junction", Path("junction")),
    "routes": ("none", None),
}


def example(setting: Setting) -> tuple[list[str], Any]:
    """Words of the command line that set a setting, and the value that the record then has."""
    option = setting.names[-1]
    if setting.key in WORDS:
        word, value = WORDS[setting.key]
        return [option, word], value
    if setting.type is bool:
        return [option], True
    if setting.type is Sensor:
        return [option, "delay_s=0.2", option, "occlusion=true"], Sensor(
            delay_s=0.2, occlusion=True
        )
    if setting.words:
        word = setting.words[-1]
        return [option, word], (word,) if isinstance(setting.default, tuple) else word
    if setting.default == {}:
        return [option, "a=1", option, "b.c=no", option, "d=false"], {
            "a": 1,
            "b.c": "no",
            "d": False,
        }
    if setting.type in (int, float):
        return [option, "1"], 1
    return [option, "word"], "word"


@pytest.mark.parametrize("key", sorted(set(FIELDS) - {"additional"}))
def test_what_the_command_line_says_is_what_the_record_holds(key: str) -> None:
    """Each option alone, with words of its type."""
    words, value = example(BY_KEY[key])
    found = settings_of(_parser().parse_args(["run", *words]))
    plan = plan_from({"net": "crossing", "routes": "none"} | found, "run")
    assert getattr(plan if key in BatchPlan.model_fields else plan.scenario, key) == value
    assert found.keys() == {key}


def test_files_are_separated_by_commas(tmp_path: Path) -> None:
    """As SUMO has them."""
    files = [tmp_path / name for name in ("a.add.xml", "b c.add.xml")]
    for file in files:
        file.write_text("<additional/>", encoding="utf-8")
    found = settings_of(_parser().parse_args(["run", "-a", ",".join(map(str, files))]))
    assert plan_from({"net": "crossing"} | found, "run").scenario.additional == tuple(files)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--signal gren", "run: signal: unknown value 'gren'; did you mean 'green'?"),
        ("--approach mergin", "approaches.0: unknown value 'mergin'; did you mean 'merging'?"),
        ("--trace zzz", "run: trace: unknown value 'zzz'; valid: all, none, tests"),
        ("--ego-route ,", "--ego-route: expected at least one value, got ','"),
        ("--additional-files ,", "--additional-files: expected at least one value, got ','"),
        ("--param aim", "--param: expected KEY=VALUE, got 'aim'"),
        ("--ego-sensor occlusion", "--ego-sensor: expected KEY=VALUE, got 'occlusion'"),
    ],
)
def test_a_wrong_word_is_refused_with_the_nearest_valid_one(words: str, said: str) -> None:
    """Of settings that choose from words; and what is no list or table is none."""
    with pytest.raises(InputError) as refused:
        planned(words)
    assert said in str(refused.value)


def planned(words: str) -> BatchPlan:
    """The plan of a command line."""
    (part,) = parts_of(_parser().parse_args(["run", *words.split()]))
    return plan_from(part.defaults | part.settings, "run")


def test_the_command_alone_prints_its_help(capsys: pytest.CaptureFixture[str]) -> None:
    """And is not what anybody wanted: exit status 2."""
    assert cli.main([]) == 2
    said = capsys.readouterr()
    assert said.out.startswith("usage: cavsumo")
    assert "import-osm" in said.out
    assert said.err == ""
