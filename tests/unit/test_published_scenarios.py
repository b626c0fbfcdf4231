"""Published scenarios as scripts: their tracks, their storyboards, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from published_tracks import (
    SCENARIOS,
    WALKER,
    Reference,
    State,
    along_its_way,
    differences,
    references,
    turns,
)

from cavsumo.agents.rehearsal import STEP_S, view_of
from cavsumo.agents.storyboard import StoryRun
from cavsumo.errors import InputError
from cavsumo.model.scenario.script import ScriptedTest
from cavsumo.openscenario.parts import ScenarioChoice, scenario_parts
from cavsumo.openscenario.reading import ReadScenario, ScenarioSource, read_scenario
from cavsumo.openscenario.vocabulary import markdown_table

HEADER = (
    '<FileHeader revMajor="1" revMinor="3" date="2026-11-30T00:00:00" author="" description=""/>'
)
BOX = (
    '<BoundingBox><Center x="0" y="0" z="1"/><Dimensions length="{}" width="{}" height="2"/>'
    "</BoundingBox>"
)
SPEED = (
    '<PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="{}" '
    'dynamicsDimension="time" value="{}"/><SpeedActionTarget><AbsoluteTargetSpeed value="{}"/>'
    "</SpeedActionTarget></SpeedAction></LongitudinalAction></PrivateAction>"
)
TELEPORT = (
    '<PrivateAction><TeleportAction><Position><WorldPosition x="{}" y="{}" h="{}"/></Position>'
    "</TeleportAction></PrivateAction>"
)
EGO_NEAR = (
    '<ByEntityCondition><TriggeringEntities triggeringEntitiesRule="any"><EntityRef '
    'entityRef="Ego"/></TriggeringEntities><EntityCondition>{}</EntityCondition>'
    "</ByEntityCondition>"
)
TIME = (
    '<ByValueCondition><SimulationTimeCondition rule="greaterOrEqual" value="{}"/>'
    "</ByValueCondition>"
)


def scenario(
    events: str, *, walker: str = TELEPORT.format(50, -5, 1.5707963267948966), more: str = ""
) -> str:
    """A scenario: an ego of 10 m/s along y = 0 from x = 0, a walker 50 m ahead beside its way."""
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<OpenSCENARIO>{HEADER}
<ParameterDeclarations/><CatalogLocations/><RoadNetwork/>
<Entities>
<ScenarioObject name="Ego">
<Vehicle name="e" vehicleCategory="car">{BOX.format(4, 2)}</Vehicle>
</ScenarioObject>
<ScenarioObject name="Walker">
<Pedestrian name="w" pedestrianCategory="pedestrian" mass="75">{BOX.format(0.5, 0.5)}</Pedestrian>
</ScenarioObject>
</Entities>
<Storyboard><Init><Actions>
<Private entityRef="Ego">{TELEPORT.format(0, 0, 0)}{SPEED.format("step", 0, 10)}</Private>
<Private entityRef="Walker">{walker}</Private>
</Actions></Init>
<Story name="story"><Act name="act"><ManeuverGroup name="group" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"><EntityRef entityRef="Walker"/></Actors>
<Maneuver name="manoeuvre">{events}</Maneuver></ManeuverGroup></Act></Story>
<StopTrigger>{more}</StopTrigger></Storyboard></OpenSCENARIO>
"""


def event(action: str, condition: str = "", name: str = "go", **given: object) -> str:
    """An event with one action, and a condition with a delay and an edge."""
    delay, edge = given.get("delay", 0), given.get("edge", "none")
    start = (
        f'<StartTrigger><ConditionGroup><Condition name="c" delay="{delay}" conditionEdge="{edge}">'
        f"{condition}</Condition></ConditionGroup></StartTrigger>"
        if condition
        else ""
    )
    return (
        f'<Event name="{name}" priority="override"><Action name="a {name}">{action}</Action>{start}'
        "</Event>"
    )


def read(tmp_path: Path, text: str) -> ReadScenario:
    """A scenario of some text."""
    file = tmp_path / "some.xosc"
    file.write_text(text, encoding="utf-8")
    return read_scenario(ScenarioSource(file, {}))


def rehearsed(
    made: ReadScenario, until: float = 50.0, ego_mps: float | None = None
) -> list[tuple[float, State, State]]:
    """The states of ego and first tester, with an ego that keeps its speed, without SUMO."""
    script = ScriptedTest.model_validate(made.settings["script"])
    if ego_mps is not None:
        own = script.ego.model_copy(update={"speed_mps": ego_mps})
        script = script.model_copy(update={"ego": own})
    story, found = StoryRun(script, STEP_S), []
    for step in range(round(until / STEP_S)):
        view = view_of(script, story, step * STEP_S)
        story.advance(view)
        ego, tester = (view.states[name] for name in ("ego", "tester0"))
        found.append((view.time, (*ego[1:3], ego.o, ego.v), (*tester[1:3], tester.o, tester.v)))
        if story.stopped:
            break
    return found


def begins(track: list[tuple[float, State, State]]) -> float:
    """When the tester began to move, from two later places of a steady motion."""
    first = track[0][2]
    (t0, _, a), (t1, _, b) = track[-50], track[-1]
    gone = [math.dist(first[:2], state[:2]) for state in (a, b)]
    return t0 - gone[0] * (t1 - t0) / (gone[1] - gone[0])


@pytest.mark.parametrize("case", [pytest.param(c, id=c.id) for c in references()])
def test_a_target_is_where_the_reference_track_has_it(case: Reference) -> None:
    """Within 0.01 m and 0.01 m/s from four seconds before contact on, in 65 cases of Euro NCAP."""
    played = rehearsed(read_scenario(ScenarioSource(case.file, case.values)))
    place, speed = differences(case.rows, played)
    assert place < 0.01
    assert speed < 0.01


@pytest.mark.parametrize("case", [pytest.param(c, id=c.id) for c in turns()])
def test_a_target_that_meets_a_turning_ego_has_its_speed_at_its_place(case: Reference) -> None:
    """At each place of its way, also if it has to hurry: at 60 km/h it reaches 74."""
    played = rehearsed(read_scenario(ScenarioSource(case.file, case.values)))
    late, speed, place = along_its_way(case.rows, played)
    assert late < 0.0025  # the player's timestep is 0.002 s
    assert speed < 0.015
    assert place < 0.02  # of the ego: the player draws its bends in straight pieces


GO = SPEED.format("step", 0, 1)


@pytest.mark.parametrize(
    ("condition", "expected", "given"),
    [
        (TIME.format(1.237), 1.237, {}),
        (TIME.format(1.237), 2.0, {"delay": 0.763}),
        # The ego's front is 2 m before its middle, the walker's side 0.25 m before its own.
        (
            EGO_NEAR.format(
                '<RelativeDistanceCondition entityRef="Walker" relativeDistanceType="longitudinal" '
                'freespace="true" rule="lessThan" value="20"/>'
            ),
            (50 - 0.25 - 2 - 20) / 10,
            {"edge": "rising"},
        ),
        (
            EGO_NEAR.format(
                '<TimeHeadwayCondition entityRef="Walker" relativeDistanceType="longitudinal" '
                'freespace="false" rule="lessOrEqual" value="2"/>'
            ),
            3.0,
            {},
        ),
        (
            EGO_NEAR.format(
                '<TimeToCollisionCondition freespace="false" relativeDistanceType="longitudinal" '
                'rule="lessOrEqual" value="1.5"><TimeToCollisionConditionTarget><EntityRef '
                'entityRef="Walker"/></TimeToCollisionConditionTarget></TimeToCollisionCondition>'
            ),
            3.5,
            {},
        ),
        (
            EGO_NEAR.format(
                '<ReachPositionCondition tolerance="1"><Position><WorldPosition x="31" y="0"/>'
                "</Position></ReachPositionCondition>"
            ),
            3.0,
            {},
        ),
        (EGO_NEAR.format('<TraveledDistanceCondition value="12.34"/>'), 1.234, {}),
        (EGO_NEAR.format('<SpeedCondition rule="greaterThan" value="9.8"/>'), STEP_S, {}),
    ],
    ids=["time", "delay", "distance", "headway", "ttc", "reach", "travelled", "speed"],
)
def test_an_event_begins_at_the_moment_of_its_condition(
    tmp_path: Path, condition: str, expected: float, given: dict[str, object]
) -> None:
    """Between timesteps too: the moment is computed from how the quantity changes."""
    track = rehearsed(read(tmp_path, scenario(event(GO, condition, **given))), 5.0)
    assert begins(track) == pytest.approx(expected, abs=1e-6)


def test_an_event_waits_for_the_end_of_another(tmp_path: Path) -> None:
    """A linear change of 2 s, then standing half a second after its end."""
    done = (
        '<ByValueCondition><StoryboardElementStateCondition storyboardElementType="event" '
        'storyboardElementRef="first" state="completeState"/></ByValueCondition>'
    )
    events = event(SPEED.format("linear", 2, 1), TIME.format(1), "first")
    events += event(SPEED.format("step", 0, 0), done, "second", delay=0.5)
    track = rehearsed(read(tmp_path, scenario(events)), 6.0)
    assert math.dist(track[0][2][:2], track[-1][2][:2]) == pytest.approx(1.0 + 0.5, abs=1e-6)


def test_a_stop_trigger_ends_the_test(tmp_path: Path) -> None:
    """At the timestep at which it holds."""
    group = (
        '<ConditionGroup><Condition name="c" delay="0" conditionEdge="none">'
        f"{TIME.format(2.5)}</Condition></ConditionGroup>"
    )
    track = rehearsed(read(tmp_path, scenario(event(GO, TIME.format(1)), more=group)), 6.0)
    assert track[-1][0] == pytest.approx(2.5 - STEP_S, abs=1e-9)


def test_a_body_follows_a_polyline_with_times(tmp_path: Path) -> None:
    """In the frame of the road that is laid under the ego's way; it stands before and after."""
    vertex = '<Vertex time="{}"><Position><WorldPosition x="{}" y="{}"/></Position></Vertex>'
    points = "".join(vertex.format(*p) for p in ((1, 50, -5), (2, 50, -4), (4, 54, -4)))
    follow = (
        '<PrivateAction><RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t" '
        f'closed="false"><Shape><Polyline>{points}</Polyline></Shape></Trajectory></TrajectoryRef>'
        '<TimeReference><Timing domainAbsoluteRelative="absolute" scale="1" offset="0"/>'
        '</TimeReference><TrajectoryFollowingMode followingMode="position"/>'
        "</FollowTrajectoryAction></RoutingAction></PrivateAction>"
    )
    made = read(tmp_path, scenario(event(GO, TIME.format(100)), walker=follow))
    (tester,) = made.settings["script"]["testers"]
    places = tester["track"]["points_m"]
    begin = places[0]
    seen = [[round(a - b, 9) for a, b in zip(p, begin, strict=True)] for p in places]
    step = round(1 / STEP_S)
    assert seen[0] == seen[step] == [0, 0]
    assert seen[2 * step] == [0, 1]
    assert seen[3 * step] == [2, 1]
    assert seen[-1] == [4, 1]


def test_a_body_commits_once(tmp_path: Path) -> None:
    """An ego that slows down after the body has set off changes nothing for it."""
    file = SCENARIOS / WALKER
    made = read_scenario(ScenarioSource(file, {}))
    script = ScriptedTest.model_validate(made.settings["script"])
    tracks = []
    for slower in (False, True):
        story, track = StoryRun(script, STEP_S), []
        for step in range(round(6.0 / STEP_S)):
            time = step * STEP_S
            view = view_of(script, story, time)
            if slower and time > 4.0:
                view = view._replace(speed=0.5)
            story.advance(view)
            track.append(view.states["tester0"][1:])
        tracks.append(track)
    assert tracks[0] == tracks[1]


def test_variations_are_batches() -> None:
    """One for each combination, named by the parameters that vary."""
    file = SCENARIOS / "bicyclist-variations.xosc"
    found = scenario_parts(ScenarioChoice(file, {}), {})
    assert [part.name for part in found.parts] == [
        f"ego_kmh{speed}-impact_percent{share}" for speed in (40, 50) for share in (50, 75)
    ]
    speeds = [part.settings["script"]["ego"]["speed_mps"] for part in found.parts]
    assert speeds == pytest.approx([40 / 3.6, 40 / 3.6, 50 / 3.6, 50 / 3.6])


REFUSED = {
    "an action": (
        event("<PrivateAction><LateralAction/></PrivateAction>"),
        "line 18: <LateralAction>: is not understood in <PrivateAction>",
    ),
    "an attribute": (
        event(GO.replace("dynamicsShape", "dynamicShape")),
        "dynamicShape is not understood; did you mean dynamicsShape?",
    ),
    "a shape": (event(SPEED.format("sinusoidal", 2, 1)), "unknown dynamicsShape 'sinusoidal'"),
    "a parameter": (event(SPEED.format("linear", "$slow", 1)), "unknown parameter '$slow'"),
    "an expression": (
        event(SPEED.format("linear", "${__import__('os')}", 1)),
        "unknown function '__import__'",
    ),
    "an entity": (
        event(GO, EGO_NEAR.format('<RelativeSpeedCondition entityRef="Wlker" rule="lessThan" '
                                  'value="1"/>')),
        "unknown entity 'Wlker'; did you mean 'Walker'?",
    ),
    "an element": (
        event(
            GO,
            '<ByValueCondition><StoryboardElementStateCondition storyboardElementType="event" '
            'storyboardElementRef="og" state="completeState"/></ByValueCondition>',
        ),
        "unknown element of the storyboard 'og'; did you mean 'go'?",
    ),
    "a road": (
        event(GO, EGO_NEAR.format('<ReachPositionCondition tolerance="1"><Position><RoadPosition '
                                  'roadId="1" s="1" t="0"/></Position></ReachPositionCondition>')),
        "needs a road network, and RoadNetwork names none",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("events", "said"), REFUSED.values(), ids=REFUSED)
def test_what_is_not_understood_is_named(tmp_path: Path, events: str, said: str) -> None:
    """With the file, the line, and the element or the nearest name."""
    with pytest.raises(InputError) as caught:
        read(tmp_path, scenario(events))
    assert said in str(caught.value)
    assert "some.xosc" in str(caught.value)
    assert "line 1" in str(caught.value)


FOREIGN = {
    "another format": ("<OpenDRIVE/>", "begins with <OpenSCENARIO>; this file begins with <OpenDR"),
    "no XML": ("<OpenSCENARIO>", "line 1: not well-formed XML: no element found"),
    "another version": (
        '<OpenSCENARIO><FileHeader revMajor="2"/></OpenSCENARIO>',
        "revMajor: expected OpenSCENARIO XML 1, got '2'",
    ),
    "a document type": (
        '<!DOCTYPE a [<!ENTITY b "c">]><OpenSCENARIO>&b;</OpenSCENARIO>',
        "line 1: a document type (DOCTYPE)",
    ),
    "an external entity": (
        '<!DOCTYPE a SYSTEM "file:///etc/passwd"><OpenSCENARIO/>',
        "line 1: a document type (DOCTYPE)",
    ),
    "depth": ("<OpenSCENARIO>" + "<a>" * 100, "elements in each other, more than 60 deep"),
    "a long value": (f'<OpenSCENARIO a="{"b" * 3000}"/>', "a value of more than 2000 characters"),
    "an encoding": ('<?xml version="1.0" encoding="utf-7"?><OpenSCENARIO/>', "not well-formed XML"),
}


@pytest.mark.parametrize(("text", "said"), FOREIGN.values(), ids=FOREIGN)
def test_other_files_are_refused(tmp_path: Path, text: str, said: str) -> None:
    """Files of strangers are read within bounds, and nothing outside is opened."""
    with pytest.raises(InputError, match=r"some\.xosc") as caught:
        read(tmp_path, text)
    assert said in str(caught.value)


def test_files_outside_of_the_folder_are_refused(tmp_path: Path) -> None:
    """Unless their folder is named."""
    folder = tmp_path / "inner"
    folder.mkdir()
    (tmp_path / "road.xodr").write_bytes((SCENARIOS / "straight.xodr").read_bytes())
    text = scenario(event(GO)).replace(
        "<RoadNetwork/>", '<RoadNetwork><LogicFile filepath="../road.xodr"/></RoadNetwork>'
    )
    with pytest.raises(InputError, match=r"'\.\./road\.xodr' is outside of .*--scenario-root"):
        read(folder, text)
    read_scenario(ScenarioSource(folder / "some.xosc", {}, tmp_path))


def test_a_link_out_of_the_folder_is_refused(tmp_path: Path) -> None:
    """A name in the folder may be a link to another place."""
    folder = tmp_path / "inner"
    folder.mkdir()
    (folder / "road.xodr").symlink_to(SCENARIOS / "straight.xodr")
    text = scenario(event(GO)).replace(
        "<RoadNetwork/>", '<RoadNetwork><LogicFile filepath="road.xodr"/></RoadNetwork>'
    )
    with pytest.raises(InputError, match=r"outside of"):
        read(folder, text)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"impact_percent": "95"}, "impact_percent is 95.0, expected greaterOrEqual 10 and less"),
        (
            {"impact_percnt": "50"},
            "unknown parameter 'impact_percnt'; did you mean 'impact_percent'",
        ),
        ({"ego_kmh": "fast"}, "ego_kmh: expected a number, got 'fast'"),
    ],
    ids=["constraint", "name", "number"],
)
def test_values_of_parameters_are_checked(values: dict[str, str], said: str) -> None:
    """Names, types, and the constraints of the file."""
    with pytest.raises(InputError) as caught:
        read_scenario(ScenarioSource(SCENARIOS / WALKER, values))
    assert said in str(caught.value)


def test_the_table_of_the_docs_is_that_of_the_program() -> None:
    """Made anew by ``vocabulary.markdown_table`` when an element is added."""
    docs = Path(__file__).parents[2] / "docs" / "published-scenarios.md"
    assert markdown_table() in docs.read_text(encoding="utf-8")
