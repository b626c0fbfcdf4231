"""Estimates in words, as one JSON object, and as a picture of how they developed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cavsumo.batch.estimating import EstimateFacts, EventEstimate
from cavsumo.errors import InputError
from cavsumo.probability.monte_carlo import needed_without_failure
from cavsumo.probability.ratio import Ratio
from cavsumo.probability.weights import Estimate

INK, BAND, REFUSED = "#1b6ca8", "#cfe0ee", "#c0392b"


def as_json(facts: EstimateFacts, bound: float | None = None) -> dict[str, Any]:
    """The result as plain data; numbers that a refusal leaves out are None."""
    found = facts.found
    p, low, high = _numbers(facts)
    return {
        "p": p,
        "lower": low,
        "upper": high,
        "level": found.level if found else None,
        "episodes": facts.episodes,
        "method": facts.method,
        "refused": facts.refused or None,
        "failures": found.failures if found else None,
        "effective_failures": found.effective if found else None,
        "largest_weight_share": found.largest if found else None,
        "per_hour": _times(facts.per_hour, p, low, high),
        "arrivals_per_hour": facts.per_hour,
        "simulated_s": facts.seconds,
        "gain": dict(zip(("value", "lower", "upper"), map(_finite, facts.gain), strict=True)),
        "ended": facts.over or None,
        "episodes_without_failure_for_bound": needed_without_failure(bound, 0.95)
        if bound
        else None,
        "by_assertion": [_part(facts, one) for one in facts.parts],
        "looks": [_look(one) for one in facts.history],
    }


def words(facts: EstimateFacts, bound: float | None = None) -> str:
    """The result in sentences."""
    found, spent = facts.found, f"{facts.episodes} episodes, {facts.seconds:.0f} simulated seconds"
    if facts.refused or found is None:
        return f"no result: {facts.refused}\n{facts.method}: {spent}"
    hour = [facts.per_hour * one for one in (found.p, found.lower, found.upper)]
    lines = [
        f"probability of a preventable failure an encounter: {_interval(found)} "
        f"({found.level:.0%})",
        f"in an hour of exposure ({facts.per_hour:g} arrivals): "
        f"{hour[0]:.3g} [{hour[1]:.3g}, {hour[2]:.3g}]",
        f"{facts.method}: {spent}; ended because {facts.over}{_gain(facts.gain)}",
    ]
    if not found.failures:
        asked = bound or found.upper / 10
        need = needed_without_failure(asked, found.level)
        lines[0] = (
            f"no preventable failure: at most {found.upper:.3g} an encounter ({found.level:.0%}); "
            f"{need} episodes without any would show at most {asked:.2g}"
        )
    return "\n".join([*lines, *_table(facts)])


def _table(facts: EstimateFacts) -> list[str]:
    """The probabilities of the kinds of violation, in lines."""
    rows = [("assertion", "kind", "episodes", "an encounter", "an hour")]
    for one in facts.parts:
        numbers = _part_numbers(facts, one)
        if numbers is None:
            said = one.found.refused, ""
        else:
            said = _bracketed(*numbers), _bracketed(*(facts.per_hour * n for n in numbers))
        rows.append((one.assertion, one.kind, str(one.episodes), *said))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    aligned = (zip(row, widths, strict=True) for row in rows)
    level = f"each interval {facts.parts[0].found.level:.0%}, not all jointly:"
    return [level, *("  ".join(cell.ljust(n) for cell, n in row).rstrip() for row in aligned)]


def ratio_words(first: str, second: str, ratio: Ratio) -> str:
    """A comparison of two egos in a sentence."""
    if ratio.refused:
        return f"{first} over {second}: no ratio: {ratio.refused}"
    return (
        f"{first} over {second}: ratio {ratio.value:.3g} [{ratio.lower:.3g}, {ratio.upper:.3g}] "
        f"({ratio.level:.0%}), {ratio.first} and {ratio.second} failures in the same "
        f"{ratio.episodes} encounters, {ratio.both} of them common; two estimates apart need "
        f"{ratio.saved:.2g} times as many episodes"
    )


def ratio_json(ratio: Ratio) -> dict[str, Any]:
    """A comparison as plain data."""
    return {
        "ratio": _finite(ratio.value),
        "lower": _finite(ratio.lower),
        "upper": _finite(ratio.upper),
        "level": ratio.level,
        "episodes": ratio.episodes,
        "failures": [ratio.first, ratio.second],
        "common_failures": ratio.both,
        "saved": _finite(ratio.saved),
        "refused": ratio.refused or None,
    }


def draw(estimates: Mapping[str, EstimateFacts], file: Path) -> None:
    """Draw how estimates and their intervals developed, into an SVG or PNG file."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 2.8 * len(estimates)), layout="constrained")
    for axes, (name, facts) in zip(
        figure.subplots(len(estimates), squeeze=False)[:, 0], estimates.items(), strict=True
    ):
        _draw(axes, name, facts)
    svg = file.suffix == ".svg"
    metadata: dict[str, Any] = {"Date": None} if svg else {"Software": None}
    try:
        with rc_context({"svg.hashsalt": "cavsumo", "svg.fonttype": "none"}):
            figure.savefig(file, metadata=metadata)
    except OSError as error:
        raise InputError(f"--picture {str(file)!r}: {error.strerror}") from error


def _draw(axes: Any, name: str, facts: EstimateFacts) -> None:
    """One estimate: a point and an interval for each look; looks that are refused in red."""
    for one in facts.history:
        colour = REFUSED if one.refused else INK
        axes.vlines(one.episodes, one.lower, one.upper, colors=colour, linewidth=1.5)
        axes.plot(one.episodes, one.p, "o", color=colour, markersize=4)
    good = [one for one in facts.history if not one.refused]
    where = [one.episodes for one in good]
    axes.fill_between(where, [o.lower for o in good], [o.upper for o in good], color=BAND)
    axes.plot(where, [o.p for o in good], color=INK, linewidth=1.0)
    title = f"{name}: {facts.method}" + (f", refused: {facts.refused}" if facts.refused else "")
    axes.set(xlabel="episodes", ylabel="probability an encounter", title=title)
    axes.set_ylim(bottom=0.0)


def _numbers(facts: EstimateFacts) -> tuple[float | None, float | None, float | None]:
    """Estimate and interval, None where there is no result."""
    found = facts.found
    if facts.refused or found is None:
        return None, None, None
    return found.p, found.lower, found.upper


def _times(factor: float, *numbers: float | None) -> dict[str, float | None]:
    """Estimate and interval times a factor."""
    scaled = (None if one is None else factor * one for one in numbers)
    return dict(zip(("value", "lower", "upper"), scaled, strict=True))


def _look(found: Estimate) -> dict[str, Any]:
    """One look as plain data."""
    keys = ("episodes", "p", "lower", "upper", "failures")
    return {key: getattr(found, key) for key in keys} | {"refused": found.refused or None}


def _part(facts: EstimateFacts, one: EventEstimate) -> dict[str, Any]:
    """The probability of a kind of violation as plain data; None where it is refused."""
    p, low, high = _part_numbers(facts, one) or (None, None, None)
    return {
        "assertion": one.assertion,
        "kind": one.kind,
        "episodes": one.episodes,
        "p": p,
        "lower": low,
        "upper": high,
        "per_hour": _times(facts.per_hour, p, low, high),
        "refused": facts.refused or one.found.refused or None,
    }


def _part_numbers(facts: EstimateFacts, one: EventEstimate) -> tuple[float, float, float] | None:
    """Estimate and interval of a kind of violation; None where it or the whole is refused."""
    found = one.found
    refused = facts.refused or found.refused
    return None if refused else (found.p, found.lower, found.upper)


def _interval(found: Estimate) -> str:
    return _bracketed(found.p, found.lower, found.upper)


def _bracketed(p: float, low: float, high: float) -> str:
    return f"{p:.3g} [{low:.3g}, {high:.3g}]"


def _gain(gain: tuple[float, float, float]) -> str:
    """The gain over Monte Carlo in words."""
    value, low, high = gain
    if value == 1.0:
        return ""
    if not math.isfinite(value):
        return "; gain over Monte Carlo unknown"
    return f"; an episode is worth {value:.3g} [{low:.3g}, {high:.3g}] of Monte Carlo"


def _finite(number: float) -> float | None:
    """A number, None where it is not finite."""
    return number if math.isfinite(number) else None
