"""The plots of the page: SVG by matplotlib, with text as text and the page's colours.

The page is light or dark as the reader's system is, so colours are named in its style sheet: each
is drawn with a placeholder colour that is replaced by the name.
"""

from __future__ import annotations

import io
import math
import os
import re
import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cavsumo.report.compare import PairedComparison
from cavsumo.report.pages.report.words import JOINT
from cavsumo.report.rates import Share
from cavsumo.results.kaplan_meier import Curve

WIDTH_IN = 3.6  # as narrow as a phone, so that text is as large there as elsewhere
ROW_IN, FRAME_IN = 0.26, 0.3  # height of a line of bars, and of the space around them
LABEL = 30  # letters of a name beside an axis
INK, SOFT, EDGE = "#010201", "#010202", "#010203"
SERIES = [f"#0103{i:02x}" for i in range(8)]
DASHES = [(), (5, 2), (1, 1.3), (6, 2, 1, 2)]  # in widths of the line
MOST = len(SERIES)  # curves in one plot
NAMES = {INK: "var(--ink)", SOFT: "var(--soft)", EDGE: "var(--edge)"}
NAMES |= {colour: f"var(--series{i})" for i, colour in enumerate(SERIES)}
STYLE: dict[str, Any] = {
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8.5,
    "text.color": INK,
    "axes.edgecolor": EDGE,
    "axes.labelcolor": SOFT,
    "xtick.color": SOFT,
    "ytick.color": EDGE,
    "xtick.labelcolor": SOFT,
    "ytick.labelcolor": INK,
    "grid.color": EDGE,
    "grid.linewidth": 0.6,
}


class Bar(NamedTuple):
    """A figure with its interval; None for unknown values."""

    label: str
    value: float | None
    low: float | None
    high: float | None
    text: str


def share_bar(label: str, share: Share, text: str) -> Bar:
    """A share, with the interval by the first method."""
    ends = next(iter(share.intervals.values()))
    return Bar(label, share.value, ends.low, ends.high, text)


def ratio_bar(label: str, one: PairedComparison, text: str) -> Bar:
    """A ratio of rates."""
    low, high = one.interval or (None, None)
    return Bar(label, one.ratio, low, high, text)


def shares_plot(bars: Sequence[Bar], name: str) -> str:
    """Shares from 0 to their maximum, one line each; the dot is the share."""
    with _style(name):
        figure, axes = _lines(bars)
        ends = [end for bar in bars for end in (bar.high, bar.value) if end is not None]
        limit = min(1.0, 1.1 * max(ends, default=1.0)) or 1.0
        for i, bar in enumerate(bars):
            _interval(axes, i, bar, (0.0, limit))
            if bar.value is not None:
                axes.barh(i, bar.value, height=0.5, color=SERIES[0], alpha=0.22, lw=0)
        axes.set_xlim(0.0, limit)
        crowded = max((len(bar.label) for bar in bars), default=0) > LABEL // 2
        axes.xaxis.set_major_locator(MaxNLocator(2 if crowded else 5))
        axes.xaxis.set_major_formatter(lambda x, _: f"{100 * x:.3g} %")
        return _svg(figure)


def ratios_plot(bars: Sequence[Bar], name: str) -> str:
    """Ratios on a logarithmic axis that contains 1; an infinite end is drawn to the frame."""
    finite = [
        value
        for bar in bars
        for value in (bar.value, bar.low, bar.high)
        if value is not None and math.isfinite(value) and value > 0
    ]
    low, high = min([0.5, *finite]) / 1.25, max([2.0, *finite]) * 1.25
    with _style(name):
        figure, axes = _lines(bars)
        axes.set_xscale("log")
        axes.set_xlim(low, high)
        axes.axvline(1.0, color=SOFT, lw=1.0, ls=(0, (3, 2)))
        for i, bar in enumerate(bars):
            inside = bar.value is not None and low <= bar.value <= high
            _interval(axes, i, bar if inside else bar._replace(value=None), (low, high))
        axes.xaxis.set_major_formatter(lambda x, _: f"{x:g}")
        axes.xaxis.set_minor_formatter(lambda x, _: "")
        return _svg(figure)


def survival_plot(curves: Sequence[Curve], name: str) -> str:
    """The share of episodes without a test so far, with its bands [s]."""
    with _style(name):
        figure = Figure(figsize=(WIDTH_IN, 2.5), layout="constrained")
        axes = figure.add_subplot()
        for i, curve in enumerate(curves):
            colour, dash = SERIES[i % len(SERIES)], DASHES[i % len(DASHES)]
            times = np.concatenate(([0.0], curve.times))
            band: dict[str, Any] = {"step": "post", "color": colour, "lw": 0, "alpha": 0.18}
            low, high = (np.concatenate(([1.0], end)) for end in (curve.low, curve.high))
            axes.fill_between(times, low, high, **band)
            share = np.concatenate(([1.0], curve.share))
            axes.step(times, share, where="post", color=colour, lw=1.7, ls=(0, dash or None))
        axes.set(xlim=(0.0, None), ylim=(0.0, 1.02), xlabel="simulated time [s]")
        axes.set_ylabel("episodes without a test so far")
        axes.yaxis.set_major_formatter(lambda y, _: f"{100 * y:.0f} %")
        axes.tick_params(axis="y", labelcolor=SOFT)
        _plain(axes)
        axes.grid(visible=True)
        return _svg(figure)


def _style(name: str) -> Any:
    """The style for a plot, whose name sets its parts apart from those of others on the page."""
    settings: Any = STYLE | {"svg.hashsalt": name}
    return rc_context(settings)


def _lines(bars: Sequence[Bar]) -> tuple[Figure, Axes]:
    """Axes with a line for each bar, the first on top, its figures on the right."""
    figure = Figure(figsize=(WIDTH_IN, FRAME_IN + ROW_IN * len(bars)), layout="constrained")
    axes = figure.add_subplot()
    axes.set_ylim(len(bars) - 0.5, -0.5)
    axes.set_yticks(range(len(bars)), _short([bar.label for bar in bars]))
    beside = axes.secondary_yaxis("right")
    beside.set_yticks(range(len(bars)), [bar.text for bar in bars])
    beside.tick_params(length=0, labelcolor=SOFT)
    beside.spines["right"].set_visible(False)
    beside.patch.set_visible(False)
    _plain(axes)
    axes.tick_params(axis="y", length=0, pad=7)
    axes.grid(visible=True, axis="x")
    return figure, axes


def _interval(axes: Axes, i: int, bar: Bar, frame: tuple[float, float]) -> None:
    """One line: the interval with a dot at the figure, an arrow where it leaves the frame."""
    if bar.low is not None and bar.high is not None:
        for end, mark in ((bar.low, 4), (bar.high, 5)):  # matplotlib's carets to left and right
            inside = frame[0] <= end <= frame[1]
            at = min(max(end, frame[0]), frame[1])
            axes.plot([at], [i], ls="", marker="|" if inside else mark, ms=7, color=SERIES[0])
        ends = max(bar.low, frame[0]), min(bar.high, frame[1])
        axes.plot(ends, [i, i], color=SERIES[0], lw=2.0, solid_capstyle="butt")
    if bar.value is not None:
        axes.plot([bar.value], [i], ls="", marker="o", ms=5.5, color=SERIES[0], clip_on=False)


def _plain(axes: Axes) -> None:
    """Remove the frame except the lower axis, and the background."""
    axes.patch.set_visible(False)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.set_axisbelow(True)


def _short(names: Sequence[str]) -> list[str]:
    """Names as short lines beside an axis: files without their common beginning."""
    files = {name.partition(JOINT)[0] for name in names if JOINT in name}
    letters = os.path.commonprefix(list(files)) if len(files) > 1 else ""  # noqa: RUF071  # letters
    begin = max(letters.rfind(mark) for mark in "-_/") + 1
    return [_cut(name[begin:].replace(".csv" + JOINT, JOINT)) for name in names]


def _cut(text: str) -> str:
    """A name as one line that is not too long; its end, the agent, stays."""
    text = "".join(letter if letter.isprintable() else "\ufffd" for letter in text)
    return text if len(text) <= LABEL else f"{text[: LABEL // 3]}…{text[1 - LABEL + LABEL // 3 :]}"


def _svg(figure: Figure) -> str:
    """The figure as an SVG element for a page: no size, no names of its parts, named colours."""
    figure.patch.set_visible(False)
    stream = io.StringIO()
    metadata = {"Date": None, "Creator": None, "Format": None, "Type": None}
    with warnings.catch_warnings():  # the browser has the letters that are missing in this font
        warnings.filterwarnings("ignore", message="Glyph")
        figure.savefig(stream, format="svg", metadata=metadata)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    head, rest = text.split(">", 1)
    view = re.search(r'viewBox="[^"]*"', head)
    assert view is not None
    rest = re.sub(r"<(metadata|style)\b.*?</\1>", "", rest, flags=re.DOTALL)
    rest = re.sub(r' id="[a-zA-Z]+(2d|\dd)?_\d+"', "", rest)
    for stand_in, name in NAMES.items():
        rest = rest.replace(stand_in, name)
    rest = re.sub(r'font-family: [^;"]*', "font-family: inherit", rest)
    return f'<svg {view[0]} xmlns:xlink="http://www.w3.org/1999/xlink" aria-hidden="true">{rest}'
