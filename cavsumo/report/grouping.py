"""Groups of rows: those of one agent in one setting, and of one value of a column."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import pandas

from cavsumo.batch.tally import AT_ONCE, COUNTED, Found
from cavsumo.errors import InputError
from cavsumo.report.load import Batch, Evidence
from cavsumo.results.provenance import EXTENT, differences

MOST = 200  # groups; more would not be readable
# Settings in which batches of one group may differ.
APART = EXTENT | {"agents", "shard", "seed", "trace"}
# Settings that necessarily differ if rows are grouped by a column, and so do not separate groups.
MEANT: dict[str, frozenset[str]] = {
    "ego": frozenset({"ego", "ego_params"}),
    "testers": frozenset({"testers", "bodies_per_agent"}),
    "reset": frozenset({"reset"}),
    "embodiment": frozenset({"embodiment"}),
    "sumo_width_m": frozenset({"sumo_width"}),
    "net": frozenset({"net", "routes", "additional", "ego_route", "junction"}),
}
COMPARED = ("versions", "sha256", "sumo_options")  # parts of a manifest besides the plan
WITH_FILES = ("net", "file")  # where the files' checksums differ too


@dataclass(frozen=True)
class Told:
    """The identity of a group; base of the records about groups.

    Attributes:
        setting: the setting, as the names of its files; empty when there is only one.
        agent: the tester agent.
        value: the value of the column that rows are grouped by; empty when by agent.
    """

    setting: str
    agent: str
    value: str

    @property
    def whose(self) -> tuple[str, str, str]:
        """The setting, the agent and the value."""
        return self.setting, self.agent, self.value


@dataclass(frozen=True)
class Group(Told):
    """A group of rows.

    Attributes:
        rows: its rows (``Evidence.rows``), by file and run.
        sequential: how many rows there are may depend on what they found.
        reference: the driver that judged its failures; empty if not all of them were judged.
    """

    rows: pandas.DataFrame
    sequential: bool
    reference: str = ""

    @cached_property
    def found(self) -> Found:
        """The counts of its rows."""
        found = Found()
        for start in range(0, len(self.rows), AT_ONCE):
            rows = self.rows.iloc[start : start + AT_ONCE]
            none = [None] * len(rows)
            found.count({n: rows[n].tolist() if n in rows else none for n in COUNTED})
        return found

    @property
    def valid(self) -> pandas.DataFrame:
        """The rows of valid episodes."""
        return self.valid_cells(list(self.rows))

    def valid_cells(self, columns: list[str]) -> pandas.DataFrame:
        """Some columns of the rows of valid episodes."""
        return self.rows.loc[~self.rows["outcome"].isin(("error", "invalid")), columns]


def grouped(evidence: Evidence, by: str = "agent") -> list[Group]:
    """The groups in the order of settings, and of first appearance in each.

    Batches whose scenarios, files and versions agree are one setting (``provenance.differences``),
    so shards and batches of other seeds are combined; each episode counts once.
    """
    if by != "file":  # which distinguishes them
        _check_once(evidence)
    settings = settings_of(evidence.batches, by)
    names = _names(evidence.batches, settings)
    place = evidence.rows["batch"].map(dict(enumerate(settings)))
    keys = [place, evidence.rows["agent"]]
    keys += [] if by == "agent" else [evidence.rows[by].map(_word)]
    found = list(evidence.rows.groupby(keys, sort=False, observed=True))
    if len(found) > MOST:
        raise InputError(f"--by {by}: {len(found)} groups, expected a column with few values")
    found.sort(key=lambda item: item[0][0])  # stable: within a setting as they appear
    return [
        Group(
            names[key[0]],
            str(key[1]),
            "".join(map(str, key[2:])),
            rows,
            any(batch.sequential for batch in batches),
            reference_of(batches),
        )
        for key, rows in found
        for batches in ([evidence.batches[i] for i in rows["batch"].unique()],)
    ]


def reference_of(batches: Sequence[Batch]) -> str:
    """The driver that judged the failures of some batches; empty if not all of them were judged."""
    names = dict.fromkeys(batch.plan.reference for batch in batches)
    return "" if "none" in names else ", ".join(names)


def settings_of(batches: Sequence[Batch], by: str) -> list[int]:
    """The setting of each batch, numbered from 0 as they appear."""
    firsts: list[Batch] = []
    found: list[int] = []
    for batch in batches:
        same = (i for i, first in enumerate(firsts) if not any(_apart(first, batch, by)))
        place = next(same, len(firsts))
        if place == len(firsts):
            firsts.append(batch)
        found.append(place)
    return found


def _apart(first: Batch, second: Batch, by: str) -> Iterator[str]:
    """The differences that separate two batches."""
    if by == "file":
        return iter(())
    empty: dict[str, Any] = {part: {} for part in COMPARED}
    left, right = (empty | by_content(batch.manifest) for batch in (first, second))
    if by in WITH_FILES:
        left, right = left | {"sha256": {}}, right | {"sha256": {}}
    return differences(left, right, apart=APART | MEANT.get(by, frozenset()))


def by_content(manifest: Mapping[str, Any]) -> dict[str, Any]:
    """A manifest in which the scenario's files are named by their checksums.

    A network that was given by its name and by its path is then the same one.
    """
    sums = dict(manifest.get("sha256") or {})
    plan = dict(manifest.get("plan") or {})
    scenario = dict(plan.get("scenario") or {})
    files = [scenario.get("net"), scenario.get("routes"), *(scenario.get("additional") or ())]
    named = {file: sums[file] for file in files if file in sums}
    found = {
        key: named.get(scenario[key], scenario[key]) for key in ("net", "routes") if key in scenario
    }
    if "additional" in scenario:
        found["additional"] = [named.get(file, file) for file in scenario["additional"]]
    return {
        **manifest,
        "plan": plan | {"scenario": scenario | found},
        "sha256": {named.get(name, name): sha for name, sha in sums.items()},
    }


def _names(batches: Sequence[Batch], settings: Sequence[int]) -> dict[int, str]:
    """The settings by the names of their files; no names if there is only one."""
    if len(set(settings)) <= 1:
        return dict.fromkeys(settings, "")
    names: dict[int, str] = {}
    for batch, place in zip(batches, settings, strict=True):
        file = str(batch.csv_file)
        names[place] = f"{names[place]}, {file}" if place in names else file
    return names


def _check_once(evidence: Evidence) -> None:
    """Refuse batches that hold the same episode, which would count twice."""
    if len(evidence.batches) == 1:
        return
    settings, plans = settings_of(evidence.batches, "agent"), [b.plan for b in evidence.batches]
    batch = evidence.rows["batch"]
    identity = pandas.DataFrame(
        {
            "setting": batch.map(dict(enumerate(settings))),
            "seed": batch.map({i: str(plan.seed) for i, plan in enumerate(plans)}),
            "agent": evidence.rows["agent"],
            "episode": evidence.rows["run"] // batch.map(lambda i: len(plans[i].agents)),
        }
    )
    twice = identity.duplicated()
    if not twice.any():
        return
    second: Any = evidence.rows[twice].iloc[0]
    first: Any = evidence.rows[(identity == identity[twice].iloc[0]).all(axis=1)].iloc[0]
    raise InputError(
        f"run {first['run']} of {first['file']!r} and run {second['run']} of {second['file']!r} "
        "are the same episode; leave one of the files out"
    )


def _word(value: Any) -> str:
    """A cell as a word, empty for none."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:g}"
    return str(value)
