"""Files of variations: the values of a scenario's parameters, one combination after another."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from cavsumo.openscenario.files import ScenarioFiles
from cavsumo.openscenario.nodes import XmlNode
from cavsumo.openscenario.tree import XmlElement, read_xml
from cavsumo.openscenario.vocabulary import check_root, check_understood

MOST = 1000  # combinations of a file

Values = dict[str, str]


class Variations(NamedTuple):
    """A scenario and the values of its parameters in each combination."""

    file: Path
    combinations: list[Values]


def variations_of(file: Path, root: Path | None) -> Variations:
    """The scenario and the combinations of a file; a scenario itself is one without values."""
    element = check_root(read_xml(file, "scenario"))
    holder = _distribution(element)
    if holder is None:
        return Variations(file, [{}])
    check_understood(element)
    files = ScenarioFiles(file, root or file.parent)
    scenario = files.path(holder.one("ScenarioFile"), "filepath")
    inner = holder.one("Deterministic")
    choices = [list(_values(one)) for one in inner.all()]
    count = math.prod(map(len, choices))
    if count > MOST:
        raise inner.refused(f"{count} combinations, at most {MOST} are played")
    combinations = []
    for chosen in itertools.product(*choices):
        values: Values = {}
        for one in chosen:
            values |= one
        combinations.append(values)
    return Variations(scenario, combinations)


def _distribution(root: XmlElement) -> XmlNode | None:
    """The distribution of a file; None for a scenario."""
    return XmlNode(root).maybe("ParameterValueDistribution")


def _values(one: XmlNode) -> Iterator[Values]:
    """The values that a distribution gives to one parameter or several."""
    if one.tag == "DeterministicMultiParameterDistribution":
        for values in one.one("ValueSetDistribution").all():
            yield {v.word("parameterRef"): v.word("value") for v in values.all()}
        return
    name = one.word("parameterName")
    inner = one.one("DistributionSet", "DistributionRange")
    if inner.tag == "DistributionSet":
        for element in inner.all():
            yield {name: element.word("value")}
        return
    step, limits = inner.number("stepWidth"), inner.one("Range")
    low, high = limits.number("lowerLimit"), limits.number("upperLimit")
    if step <= 0.0 or high < low or (high - low) / step > MOST:
        raise inner.refused(f"expected a positive stepWidth, and at most {MOST} steps")
    for k in range(math.floor((high - low) / step + 1e-9) + 1):
        yield {name: f"{low + k * step:.12g}"}
