"""A failure before and after it was made smaller, side by side: two replays in one page."""

from __future__ import annotations

from pathlib import Path

from cavsumo.batch.sentences import many
from cavsumo.kept.candidate import Candidate
from cavsumo.kept.minimising import Minimised
from cavsumo.kept.sentence import in_words
from cavsumo.report.pages.replay.page import page
from cavsumo.report.pages.shell import render, write

FILES = Path(__file__).parent


def write_minimal_page(found: Minimised, file: Path) -> None:
    """Write the page; raises InputError when the file cannot be written."""
    write(minimal_page(found), file)


def minimal_page(found: Minimised) -> str:
    """The page: the test in a sentence, and both episodes as replays of their own."""
    before, after = found.before, found.after
    assert before.trace is not None
    assert after.trace is not None
    return render(
        FILES,
        "minimal",
        title=f"The smallest failure of run {before.run}, {before.plan.scenario.name}",
        sentence=in_words(after.plan, after.row, found.last),
        how=_how(found),
        sides=[
            ("Before", size_in_words(found.first), page(before, before.trace, found.site)),
            ("After", size_in_words(found.last), page(after, after.trace, found.site)),
        ],
    )


def size_in_words(candidate: Candidate) -> str:
    """The size of an episode in words."""
    there = len(candidate.background)
    return ", ".join(
        [
            many(len(candidate.motions), "tester"),
            f"{there} of the background" if there else "no background",
            f"motion in {many(candidate.segments, 'segment')}",
        ]
    )


def _how(found: Minimised) -> str:
    """How far it was made smaller, and at which expense."""
    played = many(found.replays, "replay")
    if found.complete:
        return f"{played}; without any one of its parts it does not fail the same way any more."
    return f"{played}, as many as were allowed; it may not be the smallest."
