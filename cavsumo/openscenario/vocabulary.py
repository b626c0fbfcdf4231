"""The elements that are understood, with their attributes; everything else is refused.

A line has an element, its attributes, and after ``|`` the elements that may be in it. ``*`` in
place of these: its content has no effect here and is not looked at. The table of the
documentation is made of it.
"""

from __future__ import annotations

import difflib
from functools import cache
from typing import NamedTuple

from cavsumo.errors import InputError
from cavsumo.openscenario.tree import XmlElement

POSITIONS = (
    "WorldPosition LanePosition RoadPosition RelativeLanePosition RelativeRoadPosition "
    "RelativeObjectPosition RelativeWorldPosition RoutePosition TrajectoryPosition"
)
ACTIONS = "GlobalAction PrivateAction"
LINES = f"""
OpenSCENARIO | FileHeader ParameterDeclarations VariableDeclarations CatalogLocations RoadNetwork \
Entities Storyboard ParameterValueDistribution Catalog
FileHeader revMajor revMinor date author description | *
ParameterDeclarations | ParameterDeclaration
ParameterDeclaration name parameterType value | ConstraintGroup
ConstraintGroup | ValueConstraint
ValueConstraint rule value |
VariableDeclarations | VariableDeclaration
VariableDeclaration name variableType value |
CatalogLocations | VehicleCatalog ControllerCatalog PedestrianCatalog MiscObjectCatalog \
EnvironmentCatalog ManeuverCatalog TrajectoryCatalog RouteCatalog
VehicleCatalog | Directory
ControllerCatalog | Directory
PedestrianCatalog | Directory
MiscObjectCatalog | Directory
EnvironmentCatalog | Directory
ManeuverCatalog | Directory
TrajectoryCatalog | Directory
RouteCatalog | Directory
Directory path |
Catalog name | *
RoadNetwork | LogicFile SceneGraphFile
LogicFile filepath |
SceneGraphFile filepath |
Entities | ScenarioObject
ScenarioObject name | CatalogReference Vehicle Pedestrian MiscObject ObjectController
ObjectController name | *
CatalogReference catalogName entryName | ParameterAssignments
ParameterAssignments | ParameterAssignment
ParameterAssignment parameterRef value |
Vehicle name vehicleCategory mass model3d role | ParameterDeclarations BoundingBox Performance \
Axles Properties
Pedestrian name pedestrianCategory mass model model3d role | ParameterDeclarations BoundingBox \
Properties
MiscObject name miscObjectCategory mass model3d | ParameterDeclarations BoundingBox Properties
BoundingBox | Center Dimensions
Center x y z |
Dimensions length width height |
Performance maxSpeed maxAcceleration maxDeceleration maxAccelerationRate maxDecelerationRate |
Axles | *
Properties | *
Storyboard | Init Story StopTrigger
Init | Actions
Actions | GlobalAction Private
Private entityRef | PrivateAction
Story name | ParameterDeclarations Act
Act name | ManeuverGroup StartTrigger StopTrigger
ManeuverGroup name maximumExecutionCount | Actors CatalogReference Maneuver
Actors selectTriggeringEntities | EntityRef
EntityRef entityRef |
Maneuver name | ParameterDeclarations Event
Event name priority maximumExecutionCount | Action StartTrigger
Action name | {ACTIONS}
GlobalAction | EnvironmentAction VariableAction EntityAction
EnvironmentAction | *
VariableAction variableRef | SetAction
SetAction value |
EntityAction entityRef | DeleteEntityAction
DeleteEntityAction |
PrivateAction | LongitudinalAction TeleportAction RoutingAction SynchronizeAction AppearanceAction
AppearanceAction | *
LongitudinalAction | SpeedAction LongitudinalDistanceAction
SpeedAction | SpeedActionDynamics SpeedActionTarget
SpeedActionDynamics dynamicsShape dynamicsDimension value followingMode |
SpeedActionTarget | AbsoluteTargetSpeed
AbsoluteTargetSpeed value |
LongitudinalDistanceAction entityRef freespace continuous distance timeGap displacement \
coordinateSystem |
TeleportAction | Position
RoutingAction | AssignRouteAction FollowTrajectoryAction
AssignRouteAction | Route CatalogReference
Route name closed | ParameterDeclarations Waypoint
Waypoint routeStrategy | Position
FollowTrajectoryAction initialDistanceOffset | Trajectory CatalogReference TimeReference \
TrajectoryFollowingMode TrajectoryRef
TimeReference | None Timing
None |
Timing domainAbsoluteRelative offset scale |
TrajectoryFollowingMode followingMode |
TrajectoryRef | Trajectory CatalogReference
Trajectory name closed | ParameterDeclarations Shape
Shape | Polyline ClothoidSpline Clothoid
Polyline | Vertex
Vertex time | Position
ClothoidSpline timeEnd | ClothoidSplineSegment
ClothoidSplineSegment curvatureStart curvatureEnd length hOffset timeStart | PositionStart
Clothoid curvature curvatureDot curvaturePrime length startTime stopTime | Position
PositionStart | {POSITIONS}
SynchronizeAction masterEntityRef targetTolerance targetToleranceMaster | TargetPositionMaster \
TargetPosition FinalSpeed
TargetPositionMaster | {POSITIONS}
TargetPosition | {POSITIONS}
FinalSpeed | AbsoluteSpeed
AbsoluteSpeed value | TargetDistanceSteadyState TargetTimeSteadyState
TargetDistanceSteadyState distance |
TargetTimeSteadyState time |
Position | {POSITIONS}
WorldPosition x y z h p r |
LanePosition roadId laneId s offset | Orientation
RoadPosition roadId s t | Orientation
RelativeLanePosition entityRef dLane ds offset | Orientation
RelativeRoadPosition entityRef ds dt | Orientation
RelativeObjectPosition entityRef dx dy dz | Orientation
RelativeWorldPosition entityRef dx dy dz | Orientation
RoutePosition | RouteRef InRoutePosition Orientation
RouteRef | Route CatalogReference
InRoutePosition | FromLaneCoordinates FromRoadCoordinates
FromLaneCoordinates pathS laneId laneOffset |
FromRoadCoordinates pathS t |
TrajectoryPosition s t | TrajectoryRef Orientation
Orientation type h p r |
StartTrigger | ConditionGroup
StopTrigger | ConditionGroup
ConditionGroup | Condition
Condition name delay conditionEdge | ByEntityCondition ByValueCondition
ByValueCondition | ParameterCondition VariableCondition SimulationTimeCondition \
StoryboardElementStateCondition
ParameterCondition parameterRef rule value |
VariableCondition variableRef rule value |
SimulationTimeCondition rule value |
StoryboardElementStateCondition storyboardElementType storyboardElementRef state |
ByEntityCondition | TriggeringEntities EntityCondition
TriggeringEntities triggeringEntitiesRule | EntityRef
EntityCondition | CollisionCondition RelativeDistanceCondition DistanceCondition \
TimeHeadwayCondition TimeToCollisionCondition ReachPositionCondition SpeedCondition \
RelativeSpeedCondition TraveledDistanceCondition StandStillCondition AngleCondition
CollisionCondition | EntityRef
RelativeDistanceCondition entityRef relativeDistanceType coordinateSystem freespace rule value |
DistanceCondition coordinateSystem relativeDistanceType freespace rule value | Position
TimeHeadwayCondition entityRef coordinateSystem relativeDistanceType freespace rule value |
TimeToCollisionCondition coordinateSystem relativeDistanceType freespace rule value | \
TimeToCollisionConditionTarget
TimeToCollisionConditionTarget | EntityRef Position
ReachPositionCondition tolerance | Position
SpeedCondition rule value |
RelativeSpeedCondition entityRef rule value |
TraveledDistanceCondition value |
StandStillCondition duration |
AngleCondition angleType angle angleTolerance coordinateSystem |
ParameterValueDistribution | ScenarioFile Deterministic
ScenarioFile filepath |
Deterministic | DeterministicSingleParameterDistribution DeterministicMultiParameterDistribution
DeterministicSingleParameterDistribution parameterName | DistributionSet DistributionRange
DistributionSet | Element
Element value |
DistributionRange stepWidth | Range
Range lowerLimit upperLimit |
DeterministicMultiParameterDistribution | ValueSetDistribution
ValueSetDistribution | ParameterValueSet
ParameterValueSet | ParameterAssignment
"""
WITHOUT_EFFECT = (
    "EnvironmentAction",
    "AppearanceAction",
    "SceneGraphFile",
    "ObjectController",
)  # which a reader of the results should know of


class Known(NamedTuple):
    """The attributes of an element and the elements in it; None for any."""

    attributes: tuple[str, ...]
    inner: tuple[str, ...] | None


@cache
def vocabulary() -> dict[str, Known]:
    """The elements that are understood, by their names."""
    found = {}
    for line in LINES.strip().splitlines():
        head, _, inner = line.partition("|")
        tag, *attributes = head.split()
        inside = None if inner.strip() == "*" else tuple(inner.split())
        found[tag] = Known(tuple(attributes), inside)
    return found


def check_understood(root: XmlElement) -> None:
    """Raise InputError for the first element or attribute in it that is not understood."""
    known = vocabulary().get(root.tag)
    if known is None:
        raise root.refused("is not understood")
    for key in root.given:
        if key not in known.attributes and not key.startswith(("xmlns", "xsi:")):
            raise root.refused(f"{key} is not understood{_of(key, known.attributes)}")
    if known.inner is None:
        return
    for one in root.inner:
        if one.tag not in known.inner:
            raise one.refused(f"is not understood in <{root.tag}>{_of(one.tag, known.inner)}")
        check_understood(one)


def _of(word: str, valid: tuple[str, ...]) -> str:
    """The nearest understood word, or all of few."""
    near = difflib.get_close_matches(word, valid, n=1, cutoff=0.7)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; understood: {', '.join(valid)}" if valid else ""


def check_root(root: XmlElement) -> XmlElement:
    """The root of an OpenSCENARIO file of version 1; raises InputError for others."""
    if root.tag != "OpenSCENARIO":
        raise InputError(
            f"{root.file!r}: expected OpenSCENARIO XML, which begins with <OpenSCENARIO>; this "
            f"file begins with <{root.tag[:40]}>"
        )
    header = next((one for one in root.inner if one.tag == "FileHeader"), None)
    if header is None or header.given.get("revMajor") != "1":
        given = header.given.get("revMajor") if header else None
        raise (header or root).refused(f"revMajor: expected OpenSCENARIO XML 1, got {given!r}")
    return root


def markdown_table() -> str:
    """The table of the documentation: elements, their attributes, and what may be in them."""
    lines = ["| element | attributes | in it |", "| --- | --- | --- |"]
    for tag, known in vocabulary().items():
        inner = "not looked at" if known.inner is None else ", ".join(known.inner)
        lines.append(f"| `{tag}` | {', '.join(known.attributes)} | {inner} |")
    return "\n".join(line.replace("|  |", "| |").replace("|  |", "| |") for line in lines)
