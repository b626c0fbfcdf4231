"""``cavsumo regress``: kept tests against another ego."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cavsumo.cli.requests.regress import RegressOptions
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.errors import Exit, InputError
from cavsumo.kept.regression import (
    ELSEWHERE,
    ERROR,
    FAILS,
    STANDS,
    OtherEgo,
    counts,
    lines,
    regressions,
)
from cavsumo.report.junit_kept import junit_of_kept


def regress(wanted: RegressOptions) -> int:
    """Play the tests, tell their results, and write them."""
    ego = OtherEgo(wanted.ego, wanted.ego_param, wanted.testers, wanted.trust)
    step = f"playing {len(wanted.tests)} kept tests"
    with SlowSteps(quiet=wanted.quiet) as steps:
        steps.begin(step)
        found = regressions(
            wanted.tests, ego, wanted.jobs, lambda done: steps.begin(step, f"{done} played")
        )
    told = list(lines(found))
    print("\n".join(told[-1:] if wanted.quiet else told))
    if wanted.junit is not None:
        _write(wanted.junit, junit_of_kept(found, wanted.ego))
        say_written([wanted.junit], quiet=wanted.quiet)
    return exit_status(counts(found), wanted.strict)


def exit_status(found: Mapping[str, int], strict: bool) -> int:
    """3 a test could not be played, 1 one still fails or the ego stands still, else 0.

    ``strict``: also 1 for a test that no longer meets the ego.
    """
    if found[ERROR]:
        return Exit.NOT_RUN
    failed = found[FAILS] + found[STANDS] + (found[ELSEWHERE] if strict else 0)
    return Exit.VIOLATED if failed else Exit.OK


def _write(file: Path, text: str) -> None:
    """Write a file; raises InputError when that is not possible."""
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"--junit {str(file)!r}: {error.strerror}") from error
