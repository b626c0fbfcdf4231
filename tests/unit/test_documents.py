"""Documents within bounds: what is damaged is refused in words that speak of the file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cavsumo.cli import main
from cavsumo.errors import LONGEST, InputError, ResultsError, sentence, shown
from cavsumo.model.documents import DEPTH, json_of, read_text, toml_of
from cavsumo.model.scenario import plan_from
from cavsumo.model.study import read_study
from cavsumo.results.reading import read_manifest
from cavsumo.results.schema import check_frame, check_row

DEEP = 5000


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * DEEP + "]" * DEEP, "more than 60 deep"),
        ("[" * DEEP, "more than 60 deep"),
        ('{"a":' * DEEP + "1" + "}" * DEEP, "more than 60 deep"),
        ("[" * (DEPTH + 1) + "]" * (DEPTH + 1), "more than 60 deep"),
        ("9" * 5000, "a whole number of more than 40 digits"),
        ("[" + "9" * 41 + "]", "a whole number of more than 40 digits"),
        ("NaN", "NaN is no number of JSON"),
        ('{"a": 1,\n "b" 2}', "no JSON at line 2, column 6"),
    ],
)
def test_json_beyond_the_bounds_is_refused(text: str, words: str) -> None:
    """Deep nesting and long numbers would be errors of Python's wherever they are used."""
    with pytest.raises(ValueError, match=words):
        json_of(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a = " + "[" * DEEP + "]" * DEEP, "more than 60 deep"),
        ("a = " + "9" * 5000, "a whole number of more than 40 digits"),
        ("a = " + "9" * 400, "a whole number of more than 40 digits"),
        ("a = = 1", "no TOML: "),
    ],
)
def test_toml_beyond_the_bounds_is_refused(text: str, words: str) -> None:
    """As JSON."""
    with pytest.raises(ValueError, match=words):
        toml_of(text)


def test_what_lies_within_the_bounds_is_read() -> None:
    """As the libraries read it."""
    document = {"a": [1, -2.5, None, True, "\u00e9"], "b": {"c": 10**39}}
    assert json_of(json.dumps(document)) == document
    assert toml_of('a = [1, 2.5]\nb = {c = "x"}') == {"a": [1, 2.5], "b": {"c": "x"}}
    nested = "[" * DEPTH + "]" * DEPTH
    assert json.dumps(json_of(nested)) == nested


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("gone", None, "'gone': cannot be read: No such file"),
        ("a\0b", None, "cannot be read: no name of a file"),
        ("x" * 300, None, "cannot be read: File name too long"),
        ("latin", b"a\nb\xe9c", "'latin': line 2: no UTF-8, byte 0xe9"),
        ("large", b"x" * 11, "more than 10 bytes"),
    ],
)
def test_a_file_that_is_no_text_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, data: bytes | None, words: str
) -> None:
    """With the sort of file, its name and the line."""
    monkeypatch.chdir(tmp_path)
    if data is not None:
        Path(name).write_bytes(data)
    with pytest.raises(ResultsError) as error:
        read_text(Path(name), "rows", ResultsError, largest=10)
    assert str(error.value).startswith("rows ")
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ("net = []", "run: net: expected a path, got []"),
        ('net = "crossing"\nroutes = []', "run: routes: expected a path, got []"),
        ('net = "crossing"\nformulas = true', "run: formulas: expected a table, got True"),
        (f'net = "crossing"\ntraffic = {"9" * 400}', "more than 40 digits"),
    ],
)
def test_settings_of_the_wrong_type_are_refused(tmp_path: Path, settings: str, words: str) -> None:
    """By their key."""
    file = tmp_path / "c.toml"
    file.write_text(settings, encoding="utf-8")
    with pytest.raises(InputError) as error:
        plan_from(read_study(file, {})[0].settings, "run")
    assert words in str(error.value)


def test_a_path_that_the_system_does_not_take_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Wherever it was named."""
    monkeypatch.chdir(tmp_path)
    Path("c.toml").write_text(f'net = "{"x" * 300}"', encoding="utf-8")
    for words in (["run", "-n", "x" * 300], ["run", "-c", "c.toml"], ["inspect", "x" * 300]):
        assert main(words) == 2
        said = capsys.readouterr().err
        assert said.count("\n") == 1
        assert "File name too long" in said
        assert len(said) < LONGEST


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"status": None}, "status: Input should be a valid string, got None"),
        ({"sha256": []}, "sha256: expected a table, got []"),
        ({"learned": {"a": 1}}, "learned.a: expected a list, got 1"),
    ],
)
def test_a_manifest_of_another_shape_is_refused(
    tmp_path: Path, change: dict[str, object], words: str
) -> None:
    """By its key, before anybody looks into it."""
    manifest = {"format": "cavsumo-results-1", "status": "finished", "plan": {}} | change
    (tmp_path / "r.json").write_text(json.dumps(manifest), encoding="utf-8")
    with pytest.raises(ResultsError) as error:
        read_manifest(tmp_path / "r.csv")
    assert words in str(error.value)


def test_a_manifest_without_a_status_is_refused(tmp_path: Path) -> None:
    """Nobody can say whether the batch is whole."""
    (tmp_path / "r.json").write_text('{"format": "cavsumo-results-1"}', encoding="utf-8")
    with pytest.raises(ResultsError, match="status: Field required"):
        read_manifest(tmp_path / "r.csv")


ROW = {"run": "3", "seed": "5", "outcome": "violated", "time_s": "8.000"} | {
    "trigger_time_s": "2.5",
    "violation_time_s": "3.1",
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"trigger_time_s": "soon"}, "trigger_time_s is 'soon', expected a number"),
        ({"trigger_time_s": "nan"}, "trigger_time_s is 'nan', expected a number"),
        ({"violation_time_s": ""}, "violation_time_s is '', expected a number"),
        ({"seed": "\u00b2"}, "expected a whole number"),
        ({"outcome": "lost"}, "outcome is 'lost', expected one of violated, held"),
    ],
)
def test_a_cell_that_is_no_number_is_refused(change: dict[str, str], words: str) -> None:
    """By its column."""
    check_row(ROW)
    with pytest.raises(ValueError, match=r"^[a-z_]+ is ") as error:
        check_row(ROW | change)
    assert words in str(error.value)


@pytest.mark.parametrize("pose", [[0.0, 0.0, 1.0], ["0", 0.0, 1.0, 0.0], [1e300, 0.0, 0.0, 0.0]])
def test_a_frame_with_a_pose_that_is_none_is_refused(pose: list[object]) -> None:
    """Four finite numbers, of a size that can be drawn."""
    frame = {"step": 0, "time_s": 0.0, "ego": [0.0, 0.0, 1, 0.0], "steering": 0.0} | {
        "testers": {},
        "background": {},
    }
    check_frame(frame, acted=False)
    with pytest.raises(ValueError, match="ego"):
        check_frame(frame | {"ego": pose}, acted=False)


def test_messages_are_bounded() -> None:
    """A value is quoted in part, a long message loses its middle and its line breaks."""
    assert shown("x") == "'x'"
    assert len(shown("x" * 10_000)) < 100
    nested: list[object] = []
    for _ in range(100_000):
        nested = [nested]
    assert shown(nested) == "a list"
    said = sentence(InputError("begin\n" + "x" * 10_000 + " end"))
    assert len(said) <= LONGEST
    assert said.startswith("begin x")
    assert said.endswith(" end")
