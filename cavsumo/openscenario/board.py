"""The storyboard: stories, acts, groups and manoeuvres as a flat list of events."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from cavsumo.model.scenario.storyboard import StoryEvent, StoryTrigger
from cavsumo.openscenario.actions import Actions
from cavsumo.openscenario.conditions import Conditions, at_beginning
from cavsumo.openscenario.files import declared
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.places import Places

PRIORITIES = ("override", "overwrite", "parallel")


@dataclass(frozen=True)
class PlacedEvent:
    """An event with what is around it.

    Attributes:
        event: its element.
        within: names of its story, act, group and manoeuvre.
        actors: entities that act.
        act: the element of its act.
    """

    event: XmlNode
    within: tuple[str, ...]
    actors: tuple[str, ...]
    act: XmlNode


def events_in(board: XmlNode, places: Places) -> Iterator[PlacedEvent]:
    """All events of a storyboard in the order of the file."""
    for story in board.all("Story"):
        story = story.within(declared(story, {}))
        for act in story.all("Act"):
            for group in act.all("ManeuverGroup"):
                yield from _in_group(group, act, (story.word("name"), act.word("name")), places)


def _in_group(
    group: XmlNode, act: XmlNode, within: tuple[str, ...], places: Places
) -> Iterator[PlacedEvent]:
    """The events of a group."""
    _once(group)
    who = group.one("Actors")
    if who.truth("selectTriggeringEntities", False):
        raise who.refused("selectTriggeringEntities: expected false")
    actors = tuple(one.word("entityRef") for one in who.all("EntityRef"))
    for one in group.all("Maneuver", "CatalogReference"):
        manoeuvre = places.resolved(one, "Maneuver")
        names = (*within, group.word("name"), manoeuvre.word("name"))
        for event in manoeuvre.all("Event"):
            _once(event)
            yield PlacedEvent(event, names, actors, act)


def _once(node: XmlNode) -> None:
    """Refuse what is to happen several times."""
    if node.number("maximumExecutionCount", 1.0) != 1.0:
        raise node.refused("maximumExecutionCount: expected 1")


def elements_of(events: list[PlacedEvent]) -> set[str]:
    """The names of all elements with events."""
    return {name for one in events for name in (*one.within, one.event.word("name"))}


def story_events(
    events: list[PlacedEvent], conditions: Conditions, actions: Actions
) -> list[StoryEvent]:
    """The events that may ever happen; their actions are noted where these change the beginning."""
    found = []
    for one in events:
        starts = [
            conditions.trigger(holder.maybe("StartTrigger")) for holder in (one.act, one.event)
        ]
        whole: list[StoryTrigger] = [trigger for trigger in starts if trigger is not None]
        if len(whole) < len(starts):
            continue  # its conditions of parameters do not hold
        stop = one.act.maybe("StopTrigger")
        stops = conditions.trigger(stop) if stop else None
        if stop is not None and stops == ():
            raise stop.refused("expected a condition that does not hold from the beginning")
        at_once = all(map(at_beginning, whole))
        made = actions.of_event(one.event, list(one.actors), at_once)
        found.append(
            StoryEvent(
                name=one.event.word("name"),
                within=one.within,
                starts=tuple(trigger for trigger in whole if trigger),
                stops=stops or (),
                overrides=one.event.choice("priority", PRIORITIES, "parallel") != "parallel",
                actions=tuple(made),
            )
        )
    return found
