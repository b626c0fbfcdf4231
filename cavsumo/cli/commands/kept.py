"""``cavsumo minimise`` and ``cavsumo keep``: tests that are kept, as small as they can be."""

from __future__ import annotations

from pathlib import Path

from cavsumo.batch.located import located
from cavsumo.batch.replay import Record, check_played, recorded, recorded_alone
from cavsumo.batch.replaying import Located, play_back
from cavsumo.cli.requests.kept import KeepOptions
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.errors import Exit
from cavsumo.kept.candidate import Candidate
from cavsumo.kept.cavtest import is_cavtest, read_cavtest
from cavsumo.kept.minimising import minimised
from cavsumo.kept.sentence import in_words
from cavsumo.report.kept_files import write_kept_test, write_minimal_test
from cavsumo.report.pages.minimal.page import size_in_words, write_minimal_page
from cavsumo.results.trace_file import is_trace


def minimise(wanted: KeepOptions) -> int:
    """Make a failure as small as it can be, tell it in a sentence, and write it."""
    record = found_episode(wanted)
    check_played(record)
    with SlowSteps(quiet=wanted.quiet) as steps:
        steps.begin(f"making run {record.run} smaller")

        def notice(replays: int, best: Candidate) -> None:
            steps.begin(f"making run {record.run} smaller", _progress(replays, best))

        found = minimised(record, _here(wanted), wanted.replays, notice)
        if wanted.output is not None:
            write_minimal_test(wanted.output, found)
        if wanted.html is not None:
            write_minimal_page(found, wanted.html)
    print(in_words(found.after.plan, found.after.row, found.last))
    print(f"before: {size_in_words(found.first)}; after: {size_in_words(found.last)}")
    enough = "" if found.complete else ", as many as were allowed: it may not be the smallest"
    print(f"{found.replays} replays{enough}")
    say_written([wanted.output, wanted.html])
    return Exit.OK


def keep(wanted: KeepOptions) -> int:
    """Play an episode back and write it as one file."""
    assert wanted.output is not None
    record = found_episode(wanted)
    check_played(record)
    with SlowSteps() as steps:
        steps.begin(f"playing run {record.run} back")
        located_record = _here(wanted)(record)
        there, site = play_back(located_record, lambda one: one)
        write_kept_test(wanted.output, there, site)
    say_written([wanted.output])
    return Exit.OK


def _progress(replays: int, best: Candidate) -> str:
    """The smallest test so far."""
    return f"{replays} replays, {size_in_words(best)}"


def found_episode(wanted: KeepOptions) -> Record:
    """The episode that is meant."""
    file: Path = wanted.results
    allowed = None if wanted.trust else ()
    if is_cavtest(file):
        return read_cavtest(file, allowed).record
    if is_trace(file):
        return recorded_alone(file, allowed, anew=False)
    assert wanted.run is not None
    return recorded(file, wanted.run, allowed)


def _here(wanted: KeepOptions) -> Located:
    """Gives a record the present paths of its files."""
    if is_cavtest(wanted.results):
        return lambda record: record
    return lambda record: located(record, wanted.net, wanted.routes)
