"""Triggers: conditions of a storyboard, those of parameters computed at once."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from cavsumo.errors import UnknownName
from cavsumo.model.curve import Pose
from cavsumo.model.scenario.storyboard import LEVELS, StoryCondition, StoryTrigger
from cavsumo.openscenario.files import compared
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.places import Places

RULES = (
    "greaterThan",
    "greaterOrEqual",
    "lessThan",
    "lessOrEqual",
)
EQUAL = ("equalTo", "notEqualTo")
EDGES = ("none", "rising", "falling", "risingOrFalling")
STATES = (
    "standbyState",
    "runningState",
    "completeState",
    "startTransition",
    "endTransition",
)
AXES: Mapping[str, str] = {
    "cartesianDistance": "cartesian",
    "euclidianDistance": "cartesian",
    "lateral": "lateral",
    "longitudinal": "longitudinal",
}


@dataclass
class Conditions:
    """Reads conditions.

    Attributes:
        places: of the scenario.
        body: the id of the body that an entity is; raises InputError for others.
        elements: names of the elements of the storyboard.
        variables: names of its variables.
        move: brings a place to the road that is played on.
        backwards: bodies that drive backwards: what they look at lies behind.
    """

    places: Places
    body: Callable[[XmlNode, str], str]
    elements: Collection[str]
    variables: Collection[str]
    move: Callable[[Pose], Pose]
    backwards: Collection[str] = ()

    def trigger(self, holder: XmlNode | None) -> StoryTrigger | None:
        """The trigger of an element that holds condition groups; None for never.

        An empty trigger holds at once.
        """
        groups = list(holder.all("ConditionGroup")) if holder else []
        if not groups:
            return ()
        found = []
        for group in groups:
            read = [self._condition(one) for one in group.all("Condition")]
            if any(one is False for one in read):
                continue
            rest = tuple(one for one in read if isinstance(one, StoryCondition))
            if not rest:
                return ()
            found.append(rest)
        return tuple(found) or None

    def _condition(self, node: XmlNode) -> StoryCondition | bool:
        """A condition; one of parameters is true or false for good."""
        shared = {
            "delay_s": node.number("delay", 0.0),
            "edge": node.choice("conditionEdge", EDGES, "none"),
        }
        inner = node.one("ByEntityCondition", "ByValueCondition")
        if inner.tag == "ByValueCondition":
            one = inner.one()
            if one.tag == "ParameterCondition":
                return self._of_parameter(one, node)
            return StoryCondition.model_validate({**shared, **self._by_value(one)})
        who = inner.one("TriggeringEntities")
        names = [one.word("entityRef") for one in who.all("EntityRef")]
        if not names:
            raise who.refused("expected an EntityRef")
        rule = who.choice("triggeringEntitiesRule", ("any", "all"))
        bodies = {
            "bodies": tuple(self.body(who, name) for name in names),
            "all_of_them": rule == "all",
        }
        content = {**bodies, **self._by_entity(inner)}
        return StoryCondition.model_validate({**shared, **self._signed(inner, content)})

    def _signed(self, holder: XmlNode, content: dict[str, Any]) -> dict[str, Any]:
        """A condition of bodies that drive backwards: their speeds are below 0 in the scenario."""
        named = {*content["bodies"], content.get("other", "")}
        sort, back = content["sort"], named.intersection(self.backwards)
        if not back or sort not in ("speed", "relative-speed", "angle"):
            return content
        if sort != "speed" or back != {*content["bodies"]}:
            raise holder.refused("is not understood of an entity that drives backwards")
        more, less = ("greater", "less") if "greater" in content["rule"] else ("less", "greater")
        return {**content, "rule": content["rule"].replace(more, less), "value": -content["value"]}

    def _of_parameter(self, one: XmlNode, condition: XmlNode) -> bool:
        """Whether a condition of a parameter holds."""
        name = one.word("parameterRef").removeprefix("$")
        if name not in one.scope:
            raise UnknownName(
                "parameter", name, one.scope, f"{one.xml.file!r}: line {one.xml.line}"
            )
        if condition.number("delay", 0.0) or condition.word("conditionEdge", "none") != "none":
            raise condition.refused(
                "a condition of a parameter needs delay 0 and conditionEdge none"
            )
        return compared(one.word("rule"), one.scope[name], one.word("value"), one)

    def _by_value(self, one: XmlNode) -> dict[str, object]:
        """A condition that has no entity."""
        if one.tag == "SimulationTimeCondition":
            return {"sort": "time", **_limit(one)}
        if one.tag == "VariableCondition":
            name = one.word("variableRef")
            if name not in self.variables:
                place = f"{one.xml.file!r}: line {one.xml.line}"
                raise UnknownName("variable", name, self.variables, place)
            rule = one.choice("rule", RULES + EQUAL)
            return {"sort": "variable", "element": name, "rule": rule, "word": one.word("value")}
        element = one.word("storyboardElementRef")
        if element not in self.elements:
            place = f"{one.xml.file!r}: line {one.xml.line}"
            raise UnknownName("element of the storyboard", element, self.elements, place)
        level = one.choice("storyboardElementType", LEVELS)
        state = one.choice("state", STATES)
        return {"sort": "state", "element": element, "level": level, "state": state}

    def _by_entity(self, holder: XmlNode) -> dict[str, object]:
        """A condition of entities."""
        one = holder.one("EntityCondition").one()
        if one.tag == "CollisionCondition":
            return {"sort": "collision", **self._other(one.one("EntityRef"))}
        if one.tag == "StandStillCondition":
            return {"sort": "standstill", "value": one.number("duration")}
        if one.tag == "TraveledDistanceCondition":
            return {"sort": "travelled", "value": one.number("value")}
        if one.tag == "AngleCondition":
            return self._of_angle(one)
        if one.tag == "ReachPositionCondition":
            limit = {"rule": "lessOrEqual", "value": one.number("tolerance")}
            return {"sort": "reach", **limit, **self._place(one)}
        if one.tag == "SpeedCondition":
            return {"sort": "speed", **_limit(one)}
        if one.tag == "RelativeSpeedCondition":
            return {"sort": "relative-speed", **_limit(one), **self._other(one)}
        return self._of_distance(one)

    def _of_angle(self, one: XmlNode) -> dict[str, object]:
        """A condition of a heading in the world."""
        one.choice("angleType", ("heading",))
        one.choice("coordinateSystem", ("world",), "world")
        tolerance, angle = one.number("angleTolerance"), one.number("angle")
        value = self.move((0.0, 0.0, angle))[2]
        return {"sort": "angle", "value": value, "tolerance": tolerance}

    def _of_distance(self, one: XmlNode) -> dict[str, object]:
        """A condition of a distance, a time headway or a time to collision."""
        sorts = {"TimeHeadwayCondition": "headway", "TimeToCollisionCondition": "ttc"}
        if one.has("coordinateSystem") and one.word("coordinateSystem") != "entity":
            raise one.refused(
                "coordinateSystem: expected entity; distances along roads are not understood"
            )
        axis = one.choice("relativeDistanceType", tuple(AXES), "euclidianDistance")
        found: dict[str, object] = {
            "sort": sorts.get(one.tag, "distance"),
            "axis": AXES[axis],
            "freespace": one.truth("freespace"),
            **_limit(one),
        }
        target = one
        if one.tag == "TimeToCollisionCondition":
            target = one.one("TimeToCollisionConditionTarget").one()
        if target.has("entityRef"):
            return found | self._other(target)
        if found["freespace"]:
            raise one.refused("freespace: expected false, the distance is to a position")
        return found | self._place(target if target.tag == "Position" else one)

    def _other(self, node: XmlNode) -> dict[str, object]:
        """The body to which a condition refers."""
        return {"other": self.body(node, node.word("entityRef"))}

    def _place(self, node: XmlNode) -> dict[str, object]:
        """The place to which a condition refers."""
        position = node if node.tag == "Position" else node.one("Position")
        return {"place_m": self.move(self.places.spot(position).pose)[:2]}


def _limit(node: XmlNode) -> dict[str, object]:
    """The rule and the number of a condition of a quantity."""
    rule = node.word("rule")
    if rule in EQUAL:
        raise node.refused(
            f"rule: {rule} of a quantity that changes evenly; expected {RULES[1]}, ..."
        )
    return {"rule": node.choice("rule", RULES), "value": node.number("value")}


def at_beginning(trigger: StoryTrigger) -> bool:
    """Whether a trigger holds from the beginning on, or just after."""
    return not trigger or any(
        all(
            one.sort == "time" and one.rule.startswith("greater") and one.value + one.delay_s <= 0.0
            for one in group
        )
        for group in trigger
    )
