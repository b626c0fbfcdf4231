"""The tables of the experiment: agency.csv, and those in README.md.

    python experiments/tables.py agency-*.csv

The files are the results of ``cavsumo run -c experiments/agency.toml -o agency.csv``, one for each
place and number of testers.
"""

from __future__ import annotations

import argparse
import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from cavsumo.batch.summary import interval, percent
from cavsumo.report.analysis import Report, analyse
from cavsumo.report.compare import PairedComparison
from cavsumo.report.rates import WILSON, Rates, Share
from cavsumo.results.statistics import rate

HERE = Path(__file__).resolve().parent
PLACES = ("straight", "crossing", "timegap", "junction")
# What they call our testers.
THEIRS = {
    "random": "random",
    "programmed-random": "constrained random",
    "proximity": "proximity",
    "nearest": "election",
    "q-learning": "Q-learning",
}
BASIS = "programmed-random"  # what the published headline compares with
Peers = Mapping[tuple[str, str, int], Mapping[str, str]]
Cell = tuple[str, int]


def main() -> None:
    """Read the results, write the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", nargs="+", type=Path)
    files = parser.parse_args().results
    report = analyse(sorted(files, key=cell_of))
    write_tables(
        {
            "rates": rates(report),
            "peers": beside_peers(report, peers()),
            "ratios": ratios(report),
            "learning": learning(report),
        }
    )
    (HERE / "agency.csv").write_text(figures(report), encoding="utf-8")


def cell_of(file: Path | str) -> Cell:
    """Place and number of testers, from the name of the results."""
    place, testers = Path(file).stem.split("-")[-2:]
    return str(PLACES.index(place)), int(testers.removeprefix("testers"))


def named(setting: str) -> Cell:
    """The same for people."""
    place, testers = cell_of(setting)
    return PLACES[int(place)], testers


def peers() -> Peers:
    """The published figures and the re-measured ones, by source, tester and number."""
    with (HERE / "peers.csv").open(encoding="utf-8", newline="") as stream:
        return {(r["source"], r["tester"], int(r["testers"])): r for r in csv.DictReader(stream)}


def rates(report: Report) -> Iterator[str]:
    """Tests, unfair episodes and failures, a line for each place and tester."""
    numbers = sorted({named(one.setting)[1] for one in report.rates})
    yield from headed(["place", "tester", *(f"{n} pedestrian{'s' * (n > 1)}" for n in numbers)])
    found = {(*named(one.setting), one.agent): one for one in report.rates}
    agents = list(dict.fromkeys(one.agent for one in report.rates))
    for place in PLACES:
        for agent in agents:
            cells = [told(found[place, n, agent]) for n in numbers if (place, n, agent) in found]
            if cells:
                yield line([place, agent, *cells])


def told(one: Rates) -> str:
    """Tests with interval, unfair, failures of tests."""
    return (
        f"**{plain(one.tests)}** {span(one.tests)}; {plain(one.unfair)}; "
        f"{one.failures.count}/{one.failures.total}"
    )


def beside_peers(report: Report, known: Peers) -> Iterator[str]:
    """The straight road beside what others found."""
    titles = ["tester", "pedestrians", "published", "CAV-Gym", "unfair there"]
    yield from headed([*titles, "here", "unfair here", "overlap with CAV-Gym"])
    for one in report.rates:
        place, testers = named(one.setting)
        if place != "straight" or one.agent not in THEIRS:
            continue
        theirs = THEIRS[one.agent]
        paper = known.get(("published", theirs, testers))
        gym = known["re-measured", theirs, testers]
        low, high = float(gym["low"]), float(gym["high"])
        overlap = one.tests.intervals[WILSON].overlaps(low / 100, high / 100)
        yield line(
            [
                one.agent,
                str(testers),
                f"{paper['percent']} {published_span(paper)}" if paper else "",
                f"{gym['percent']} [{low}, {high}]",
                f"{100 * int(gym['unfair']) / int(gym['episodes']):.1f}",
                f"{plain(one.tests)} {span(one.tests)}",
                plain(one.unfair),
                "yes" if overlap else "**no**",
            ]
        )


def published_span(row: Mapping[str, str]) -> str:
    """The interval that the paper leaves out."""
    episodes = int(row["episodes"])
    return interval(rate(round(float(row["percent"]) / 100 * episodes), episodes))


def ratios(report: Report) -> Iterator[str]:
    """How many times as many tests as the programmed random tester."""
    compared = {(*named(c.setting), c.first): c for c in with_basis(report)}
    testers = list(dict.fromkeys(c.first for c in compared.values()))
    yield from headed(["place", "pedestrians", *testers])
    for place, n in dict.fromkeys(key[:2] for key in compared):
        cells = [ratio_of(compared[place, n, tester]) for tester in testers]
        yield line([place, str(n), *cells])


def with_basis(report: Report) -> Iterator[PairedComparison]:
    """The comparisons of tests with those of the programmed random tester."""
    return (c for c in report.comparisons if c.event == "tests" and c.second == BASIS)


def ratio_of(one: PairedComparison) -> str:
    """A ratio, bold where it is another than 1 for sure."""
    if one.ratio is None or one.interval is None:
        return ""
    low, high = one.interval
    text = f"{one.ratio:.2f}"
    return f"{f'**{text}**' if one.p_holm < 0.05 else text} [{low:.2f}, {high:.2f}]"


def learning(report: Report) -> Iterator[str]:
    """What Q-learning found in the first and in the second half of its episodes."""
    yield from headed(["place", "pedestrians", "first half", "second half"])
    for group in report.groups:
        if group.agent == "q-learning":
            place, testers = named(group.setting)
            tests = group.valid["outcome"].isin(("held", "violated"))
            half = len(tests) // 2
            halves = [rate(int(part.sum()), len(part)) for part in (tests[:half], tests[half:])]
            cells = [f"{percent(r.value).removesuffix(' %')} {interval(r)}" for r in halves]
            yield line([place, str(testers), *cells])


def figures(report: Report) -> str:
    """The table as CSV: shares as numbers between 0 and 1."""
    compared = {(c.setting, c.first): c for c in with_basis(report)}
    text = io.StringIO()
    rows = [
        row_of(one, effort.tests_simulated.value, compared.get((one.setting, one.agent)))
        for one, effort in zip(report.rates, report.efforts, strict=True)
    ]
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def row_of(
    one: Rates, per_second: float | None, compared: PairedComparison | None
) -> dict[str, Any]:
    """One line of it."""
    place, testers = named(one.setting)
    row: dict[str, Any] = {"place": place, "testers": testers, "agent": one.agent}
    row |= {"episodes": one.episodes, "errors": one.errors}
    for name in ("tests", "unfair", "failures"):
        share: Share = getattr(one, name)
        low, high = share.intervals[WILSON].low, share.intervals[WILSON].high
        row |= {name: share.count, f"{name}_share": rounded(share.value)}
        row |= {f"{name}_low": rounded(low), f"{name}_high": rounded(high)}
    row["tests_per_simulated_s"] = rounded(per_second, 5)
    row["ratio"] = rounded(compared.ratio if compared else None)
    ends = (compared.interval if compared else None) or (None, None)
    row |= {"ratio_low": rounded(ends[0]), "ratio_high": rounded(ends[1])}
    row["p_holm"] = f"{compared.p_holm:.2g}" if compared else ""
    return row


def rounded(value: float | None, digits: int = 4) -> str:
    """A figure, empty for none."""
    return "" if value is None else f"{value:.{digits}f}"


def plain(share: Share) -> str:
    """A share in per cent, without the sign."""
    return percent(share.value).removesuffix(" %")


def span(share: Share) -> str:
    """Its Wilson interval."""
    return interval(share.intervals[WILSON])


def headed(titles: Sequence[str]) -> Iterator[str]:
    """The head of a Markdown table."""
    yield line(titles)
    yield line(["---"] * len(titles))


def line(cells: Iterable[str]) -> str:
    """A line of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def write_tables(tables: Mapping[str, Iterable[str]]) -> None:
    """Put tables at their places in README.md."""
    text = (HERE / "README.md").read_text(encoding="utf-8")
    for name, lines in tables.items():
        text = replaced(text, name, lines)
    (HERE / "README.md").write_text(text, encoding="utf-8")


def replaced(text: str, name: str, lines: Iterable[str]) -> str:
    """A text with other lines between ``<!-- table: NAME -->`` and ``<!-- end -->``."""
    head = f"<!-- table: {name} -->\n"
    body = "".join(f"{line}\n" for line in lines)
    pattern = f"{re.escape(head)}.*?<!-- end -->"
    new, count = re.subn(pattern, lambda _: f"{head}{body}<!-- end -->", text, flags=re.DOTALL)
    if count != 1:
        raise SystemExit(f"README.md: expected one table {name}, found {count}")
    return new


if __name__ == "__main__":
    main()
