"""A scenario is validated before anything starts; its file says what it means."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from pydantic import ValidationError

from cavsumo.batch.planned import recorded_settings
from cavsumo.cli import main
from cavsumo.errors import InputError, UnknownName
from cavsumo.model.scenario import BatchPlan, plan_from
from cavsumo.model.scenario_file import read_config
from cavsumo.results.provenance import differences


@pytest.fixture
def plan(networks: Mapping[str, Path]) -> Callable[..., BatchPlan]:
    """Call with settings for a plan on the straight road."""
    return lambda **s: plan_from({"net": networks["pedestrians"], "routes": "none"} | s, "run")


def config(folder: Path, text: str) -> Path:
    """A scenario file."""
    file = folder / "scenario.toml"
    file.write_text(text, encoding="utf-8")
    return file


# Files --------------------------------------------------------------------------------------------


def test_paths_are_relative_to_the_scenario_file(tmp_path: Path) -> None:
    """A scenario that is moved with its networks still finds them, as in SUMO."""
    file = config(
        tmp_path,
        'net = "nets/a.net.xml"\nroutes = "a.rou.xml"\nadditional = ["b.add.xml", "/c.add.xml"]\n',
    )
    assert read_config(file) == {
        "net": str(tmp_path / "nets" / "a.net.xml"),
        "routes": str(tmp_path / "a.rou.xml"),
        "additional": [str(tmp_path / "b.add.xml"), "/c.add.xml"],
    }


def test_no_routes_is_no_path(tmp_path: Path) -> None:
    """The word none means empty roads in a file too."""
    assert read_config(config(tmp_path, 'routes = "none"\n')) == {"routes": "none"}


def test_a_file_makes_a_plan(tmp_path: Path, networks: Mapping[str, Path]) -> None:
    """Everything that the command line can say a file can say."""
    file = config(
        tmp_path,
        f"""
        net = "{networks["pedestrians"]}"
        routes = "none"
        ego = "constant"
        testers = 2
        agents = ["proximity", "timing"]
        runs = 7
        end = 20
        [params]
        aim = 0.3
        "proximity.distance_m" = 12
        """,
    )
    plan = plan_from(read_config(file), str(file))
    assert (plan.agents, plan.runs, plan.scenario.ego) == (("proximity", "timing"), 7, "constant")
    assert (plan.scenario.testers, plan.scenario.end) == (2, 20.0)
    assert plan.agent_params("timing", ["aim"]) == {"aim": 0.3}
    assert plan.agent_params("proximity", ["distance_m"]) == {"distance_m": 12}


def test_an_unknown_key_suggests_the_nearest(tmp_path: Path) -> None:
    """A misspelt key is never ignored, and the message names the file."""
    with pytest.raises(UnknownName, match=r"scenario\.toml: .*'tester'; did you mean 'testers'"):
        read_config(config(tmp_path, "tester = 3\n"))


def test_malformed_toml_is_named_with_its_line(tmp_path: Path) -> None:
    """The message says in which file and on which line reading failed."""
    with pytest.raises(InputError, match=r"scenario\.toml.*line 2"):
        read_config(config(tmp_path, 'net = "a.net.xml"\nruns = = 3\n'))


@pytest.mark.parametrize("text", [b"\xff\xfe", None])
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, text: bytes | None) -> None:
    """Missing files and files that are no text are one sentence."""
    if text is not None:
        (tmp_path / "scenario.toml").write_bytes(text)
    with pytest.raises(InputError, match=r"scenario\.toml"):
        read_config(tmp_path / "scenario.toml")


# Numbers ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("testers", 0),
        ("testers", 101),
        ("testers", 1.5),
        ("runs", 0),
        ("runs", 10**9),
        ("seed", -1),
        ("end", 0.0),
        ("end", -1.0),
        ("end", float("nan")),
        ("end", float("inf")),
        ("step_length", 0.0),
        ("step_length", 2.0),
        ("step_length", float("nan")),
        ("sumo_width", 0.0),
        ("sumo_width", float("inf")),
        ("start_speed", -0.5),
        ("start_speed", float("nan")),
        ("bodies_per_agent", 0),
        ("deadline_s", 0.0),
        ("deadline_s", float("inf")),
        ("embodiment", "ghost"),
        ("trace", "some"),
        ("agents", []),
        pytest.param("assertions", []),
    ],
)
def test_what_is_out_of_range_is_named(
    plan: Callable[..., BatchPlan], key: str, value: object
) -> None:
    """The message names the key and the value; nothing out of range gets through."""
    with pytest.raises(InputError, match=rf"^run: {key}.*{value}".replace("[", r"\[")):
        plan(**{key: value})


@pytest.mark.parametrize("step", [0.00015, 0.0125, 0.1004, 1 / 60])
def test_a_timestep_is_whole_milliseconds(plan: Callable[..., BatchPlan], step: float) -> None:
    """SUMO's clock counts milliseconds; a timestep in between would drift without a word."""
    with pytest.raises(InputError, match="step_length"):
        plan(step_length=step)


@pytest.mark.parametrize("step", [0.001, 0.016, 0.02, 0.1, 0.3, 1.0])
def test_whole_milliseconds_are_kept_exactly(plan: Callable[..., BatchPlan], step: float) -> None:
    """0.3 s is 300 ms although no float is 0.3."""
    assert plan(step_length=step).scenario.step_length == step


def test_an_unknown_setting_is_refused(networks: Mapping[str, Path]) -> None:
    """Settings made in Python are checked like those of a file."""
    with pytest.raises(InputError):
        plan_from({"net": networks["pedestrians"], "tester": 3}, "run")


def test_bodies_per_agent_divides_the_testers(plan: Callable[..., BatchPlan]) -> None:
    """Five bodies are not two for each agent; six are."""
    with pytest.raises(InputError, match="bodies_per_agent 2 does not divide testers 5"):
        plan(testers=5, bodies_per_agent=2)
    assert plan(testers=6, bodies_per_agent=2).scenario.bodies_per_agent == 2


# Route files --------------------------------------------------------------------------------------


def test_the_route_file_of_a_shipped_network_is_found(
    networks: Mapping[str, Path], routes: Mapping[str, Path]
) -> None:
    """networks/NAME.net.xml goes with routes/NAME.rou.xml, nothing else given."""
    assert plan_from({"net": networks["crossing"]}, "run").scenario.routes == routes["crossing"]


def test_a_route_file_in_the_same_folder_is_found(tmp_path: Path) -> None:
    """A network and its routes side by side belong together, zipped or not."""
    (tmp_path / "town.rou.xml").write_text("<routes/>")
    for name in ("town.net.xml", "town.net.xml.gz"):
        assert plan_from({"net": tmp_path / name}, "run").scenario.routes == (
            tmp_path / "town.rou.xml"
        )
    assert plan_from({"net": tmp_path / "village.net.xml"}, "run").scenario.routes is None


def test_none_keeps_the_roads_empty(networks: Mapping[str, Path]) -> None:
    """The word none overrules the route file that would be found."""
    assert plan_from({"net": networks["crossing"], "routes": "none"}, "run").scenario.routes is None


@pytest.mark.parametrize("key", ["routes", "additional"])
def test_a_file_that_is_missing_is_named(plan: Callable[..., BatchPlan], key: str) -> None:
    """A route or additional file that is not there is found before SUMO starts."""
    value = "nowhere.xml" if key == "routes" else ["nowhere.xml"]
    with pytest.raises(InputError, match=r"no such file: 'nowhere\.xml'"):
        plan(**{key: value})


def test_a_scenario_needs_a_network() -> None:
    """Without a network there is nothing to test on, and the message says what to give."""
    with pytest.raises(InputError, match="--net"):
        plan_from({"runs": 3}, "run")


# Gone ---------------------------------------------------------------------------------------------


def test_a_setting_that_is_gone_is_refused_with_what_is_instead(
    plan: Callable[..., BatchPlan], capsys: pytest.CaptureFixture[str]
) -> None:
    """On the command line, in files and as a keyword."""
    with pytest.raises(InputError, match="run: reset: every episode has a simulation of its own"):
        plan(reset="shared")
    assert main(["run", "--reset", "shared"]) == 2
    assert "--reset: every episode has a simulation of its own" in capsys.readouterr().err


def test_recorded_plans_that_still_have_it_are_read(plan: Callable[..., BatchPlan]) -> None:
    """With the value of all batches now they are the same plans; with another one they are not."""
    new = plan()
    old = new.model_dump(mode="json") | {"reset": "fresh"}
    assert BatchPlan.model_validate(old) == new
    parts: dict[str, Mapping[str, str]] = {"versions": {}, "sha256": {}, "sumo_options": {}}
    now = {"plan": new.model_dump(mode="json"), **parts}
    assert not list(differences({"plan": old, **parts}, now))
    assert "reset" not in recorded_settings({"plan": old})
    with pytest.raises(ValidationError, match="reset shared: every episode has"):
        BatchPlan.model_validate(old | {"reset": "shared"})
