"""The prepared batch: a checked plan with all data that a process needs to play it."""

from __future__ import annotations

import dataclasses
import hashlib
import pickle
import sys
from collections.abc import Collection, Mapping, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cavsumo.agents.casting import Cast, resolve_cast, teams
from cavsumo.agents.manoeuvres import types_for
from cavsumo.agents.names import EXPOSURE, SEARCH
from cavsumo.assertions.specs import assertions_of
from cavsumo.batch.plan_names import check_names
from cavsumo.egos.base import Ego
from cavsumo.egos.ego_files import data_files, machine
from cavsumo.egos.specs import ego_of, top_speed
from cavsumo.errors import InputError
from cavsumo.model.bodies import WALKING, Kind, kind_named
from cavsumo.model.checksums import checksum
from cavsumo.model.objects import SentObject, objects_among
from cavsumo.model.scenario import BatchPlan, Scenario
from cavsumo.model.visible_files import is_visible
from cavsumo.network.scripted_site import ground, scripted_site
from cavsumo.network.site import Site, Wishes
from cavsumo.network.site_cache import site_of
from cavsumo.network.traffic import Volume
from cavsumo.network.traffic_lights import Pace
from cavsumo.probability.encounters import encounters_for
from cavsumo.probability.methods import check_episodes
from cavsumo.results.present import input_files
from cavsumo.results.provenance import checksums, traffic_checksum, unequal, versions
from cavsumo.searchers.bounds import bounded, within_of
from cavsumo.searchers.continued import SPACE, fingerprint
from cavsumo.searchers.methods import check_method, method_of, packages_of
from cavsumo.searchers.space import Space, space_of
from cavsumo.suites.cases import case_plan, case_plans, suite_inputs
from cavsumo.sumo.options import OPTIONS

Ground = tuple[str, tuple[str, ...]]  # a network and the edges of a route on it

BEYOND_S = 60.0  # how far beyond the horizon there must be demand, for waits and overtime
OUTPUTS = "ego_outputs"  # in a manifest: the files of its command that an ego wrote


@dataclass(frozen=True)
class PreparedBatch:
    """The data that a process needs to play the jobs of a batch.

    Attributes:
        plan, cast, site: the plan, its agents and its place; of a suite that of the first case.
        folder: the working folder that the plan's files are relative to.
        checksums: of the plan's files, so that a process elsewhere notices different ones.
        versions: of the packages on which results depend.
        machine: the one on which it was prepared; files that an ego writes differ on others.
        objects: the agents, the ego and the assertions that are objects of a Python session.
        grounds: of a suite, the networks of its cases.
        key: identifies all of it.
    """

    plan: BatchPlan
    cast: Cast
    site: Site
    folder: str
    checksums: Mapping[str, str]
    versions: Mapping[str, str]
    machine: str = field(default_factory=machine)
    objects: tuple[SentObject, ...] = ()
    grounds: Mapping[Ground, Site] = field(default_factory=dict)
    key: str = field(init=False)

    def __post_init__(self) -> None:
        facts = (self.plan.model_dump_json(), self.folder, self.checksums, self.versions)
        object.__setattr__(self, "key", hashlib.sha256(repr(facts).encode()).hexdigest())

    @property
    def inputs(self) -> dict[str, Path]:
        """The files that are kept with the results, by their checksums: all but programs."""
        found, sums = input_files(self.plan), self.checksums
        return {sums[name]: file for name, file in found.items() if name in sums}

    @cached_property
    def space(self) -> Space:
        """The tests from which searchers choose; raises NetworkError where it holds no start."""
        scenario, ego = self.plan.scenario, ego_of(self.plan.scenario)
        every = ego.decides_every_s if ego.decides_every_s > scenario.step_length else 0.0
        return space_of(
            self.site,
            kind_named(scenario.kind),
            teams(scenario),
            ego=ego.kind,
            start_speed=scenario.start_speed,
            every=every,
        )

    @cached_property
    def packed(self) -> bytes:
        """The batch for the processes, pickled once for all of them."""
        return pickle.dumps({f.name: getattr(self, f.name) for f in dataclasses.fields(self)})

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpacked, (self.packed,)

    def plan_of(self, run: int) -> BatchPlan:
        """The plan of one run by itself: of a suite that of its case."""
        return case_plan(self.plan, run)

    def site_of(self, plan: BatchPlan, ego: Ego) -> Site:
        """The site of the plan of one run."""
        if self.plan.suite is None:
            return self.site
        assert plan.scenario.script is not None
        base = self.grounds[_ground_of(plan.scenario)]
        return scripted_site(base, plan.scenario.script, ego.kind.length)

    def check_here(self) -> None:
        """Raise InputError unless this process sees the same inputs and versions.

        Files that the ego may have written since are not inputs (``ego_files``).
        """
        self._check_copies()
        found = {**versions(), **_checksums(self.plan, self.cast)}
        free = self._written_here()
        for name, (there, here) in unequal({**self.versions, **self.checksums}, found):
            if name in free or (there is None and name not in self.versions):
                continue
            raise InputError(f"{name} is {here} in the process that simulates, expected {there}")

    def _check_copies(self) -> None:
        """Refuse copies of moved files that this process does not see, such as a dask worker's."""
        for name, place in self.plan.scenario.places.items():
            if not is_visible(place):
                raise InputError(
                    f"{name!r} is not at {str(place)!r} for the process that simulates: it was "
                    "unpacked from the results for this machine alone; put the file where it was, "
                    "where all processes see it"
                )

    def _written_here(self) -> set[str]:
        """The files of the ego that may have changed on this machine."""
        if machine() != self.machine:
            return set()
        return {str(file) for file in data_files(self.plan.scenario.ego)}

    def without(self, outputs: Collection[str]) -> PreparedBatch:
        """The same batch, without some files as inputs."""
        kept = {name: sum for name, sum in self.checksums.items() if name not in outputs}
        same = len(kept) == len(self.checksums)
        return self if same else dataclasses.replace(self, checksums=kept)


def _unpacked(packed: bytes) -> PreparedBatch:
    """A batch from another process; it is sent to a third one unchanged."""
    batch = object.__new__(PreparedBatch)
    batch.__dict__.update(pickle.loads(packed), packed=packed)
    return batch


def _prepared(plan: BatchPlan, ego: Ego | None) -> PreparedBatch:
    """The prepared batch of a plan with one scenario."""
    scenario = plan.scenario
    check_names(plan)
    cast = resolve_cast(plan)
    for member in cast:
        member.make().prepare()
        cast.check_memory(member.label, (plan.known or {}).get(member.label), "known")
    assertions_of(scenario)
    kind = kind_named(scenario.kind)
    _check_kind(scenario, kind, cast)
    if cast.learners and plan.shard:
        raise InputError(
            f"shard {plan.shard}: {' and '.join(sorted(cast.learners))} learns from episode to "
            "episode, in sequence; learn=false plays what was learned"
        )
    if cast.searchers and plan.shard:
        raise InputError(
            f"shard {plan.shard}: {' and '.join(sorted(cast.searchers))} chooses each episode by "
            "those before it, of which a shard has only a part"
        )
    ego = ego or ego_of(scenario)
    if scenario.ego_sensor and type(ego).act is Ego.act:
        raise InputError(
            f"ego_sensor: ego {scenario.ego} is driven by SUMO, which sees everybody; a sensor "
            "needs a controller, such as time-gap"
        )
    site = _site(plan, kind, ego, cast)
    _check_exposures(site, kind, plan, cast)
    objects = objects_among([*plan.cast.values(), scenario.ego, *scenario.assertions])
    where = str(Path.cwd()), _checksums(plan, cast), versions()
    prepared = PreparedBatch(plan, cast, site, *where, objects=objects)
    for member in cast:
        if member.name == SEARCH:  # a space without a start is refused too
            space = bounded(prepared.space, within_of(member.params))
            check_method(method_of(member.params), space)
    return prepared


def prepare(plan: BatchPlan, ego: Ego | None = None) -> PreparedBatch:
    """Check every name and parameter of a plan and derive its site; raises InputError.

    ``ego`` drives instead of the one that the plan names. Of a suite every case is checked.
    """
    if plan.suite is None:
        return _prepared(plan, ego)
    first, grounds, checked = None, dict[Ground, Site](), set[tuple[float, ...]]()
    for one in case_plans(plan):
        script = one.scenario.script
        assert script is not None
        where = _ground_of(one.scenario)
        if where not in grounds:
            grounds[where] = ground(one.scenario)
        box = script.ego.speed_mps, script.ego.length_m or 0.0, script.ego.start_m
        if first is None or box not in checked:
            checked.add(box)
            driver = ego or ego_of(one.scenario)
            scripted_site(grounds[where], script, driver.kind.length)
        first = first or _prepared(one, ego)
    assert first is not None
    return replace(first, plan=plan, checksums=_checksums(plan, first.cast), grounds=grounds)


def _ground_of(scenario: Scenario) -> Ground:
    """The key of a case's network among those of its suite."""
    return str(scenario.net), scenario.ego_route


def _checksums(plan: BatchPlan, cast: Cast) -> dict[str, str]:
    """The checksums of a batch's files, those of its suite with its networks included."""
    found = checksums(plan.scenario, cast.files)
    if plan.suite is None:
        return found
    return found | {name: checksum(file) for name, file in suite_inputs(plan).items()}


def _site(plan: BatchPlan, kind: Kind, ego: Ego, cast: Cast) -> Site:
    """The site of a plan with one scenario; raises InputError where it cannot serve."""
    scenario = plan.scenario
    if scenario.script is not None:
        return scripted_site(ground(scenario), scenario.script, ego.kind.length)
    asked = wishes(plan, kind, ego, {member.manoeuvre for member in cast})
    site = site_of(scenario.net_file, scenario.ego_route, scenario.junction, ego.kind, asked)
    if scenario.embodiment == "person" and not all(area.walk for area in site.areas):
        raise InputError("jaywalk: embodiment person needs a pavement near by, and there is none")
    if site.approaches:  # missing room must be found before the first episode
        kinds, rng = [kind] * scenario.testers, np.random.default_rng(plan.seed)
        site.draw(kinds, ego.kind, scenario.start_speed, rng)
    return site


def wishes(plan: BatchPlan, kind: Kind, ego: Ego, manoeuvres: Set[str]) -> Wishes:
    """The requirements of a plan on its site besides the route."""
    scenario = plan.scenario
    volume = None
    if scenario.traffic is not None:
        seed = plan.seed if scenario.traffic_seed is None else scenario.traffic_seed
        volume = Volume(*scenario.traffic, duration=scenario.end + BEYOND_S, seed=seed)
    return Wishes(
        kind=kind,
        types=approach_types(scenario, kind, manoeuvres),
        jaywalk=scenario.jaywalk,
        volume=volume,
        signal=scenario.signal,
        pace=Pace(ego.depart_speed, top_speed(ego)),
    )


def _check_exposures(site: Site, kind: Kind, plan: BatchPlan, cast: Cast) -> None:
    """Refuse exposures that cannot be read, or that have no support at the site."""
    for member in cast:
        if member.name == EXPOSURE:
            check_episodes(str(member.params.get("method")), plan.runs)
            encounters_for(member.params, site, kind, teams(plan.scenario))


def _check_kind(scenario: Scenario, kind: Kind, cast: Cast) -> None:
    """Refuse settings that pedestrians or vehicles cannot have."""
    if scenario.jaywalk and kind.name not in WALKING:
        raise InputError(f"jaywalk: only {' and '.join(WALKING)}s start beside the road")
    if kind.name in WALKING:
        if scenario.approaches:
            raise InputError(f"kind {kind.name!r}: only vehicles have approaches; name a --kind")
        return
    for member in cast:
        if not member.drives:
            raise InputError(
                f"kind {kind.name!r}: agent {member.label} can only walk; choose another agent or "
                f"kind {' or '.join(WALKING)}"
            )


def approach_types(scenario: Scenario, kind: Kind, manoeuvres: Set[str]) -> tuple[str, ...]:
    """The types of approach of a scenario's vehicles; empty for all types, and for pedestrians.

    Those that the scenario names, else those on which the one manoeuvre of all agents is possible.
    """
    if scenario.approaches or kind.name in WALKING:
        return scenario.approaches
    return types_for(next(iter(manoeuvres))) if len(manoeuvres) == 1 else ()


def manifest(prepared: PreparedBatch) -> dict[str, Any]:
    """The manifest: the data that make a batch reproducible."""
    methods = [method_of(member.params) for member in prepared.cast if member.name == SEARCH]
    return {
        "command": ["cavsumo", *sys.argv[1:]],
        "plan": prepared.plan.model_dump(mode="json"),
        "ego_route": list(prepared.site.route.edges),
        "junction": prepared.site.route.junction,
        "sha256": {
            **prepared.checksums,
            **traffic_checksum(prepared.site),
            **({SPACE: fingerprint(prepared.space)} if prepared.cast.searchers else {}),
        },
        "versions": dict(prepared.versions) | versions(packages_of(methods)),
        "sumo_options": dict(OPTIONS),
    }
