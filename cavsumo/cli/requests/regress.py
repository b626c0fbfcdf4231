"""Options of the command regress, checked before heavy imports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cavsumo.cli.requests.files import check_folder
from cavsumo.egos.names import check_ego
from cavsumo.errors import InputError
from cavsumo.kept.names import CAVTEST
from cavsumo.model.scenario import Params


@dataclass(frozen=True)
class RegressOptions:
    """Options of the command.

    Attributes:
        tests: the files.
        ego, ego_param: the ego and its parameters.
        testers: "recorded" or "policy".
        junit: a file to write.
        jobs: tests at a time.
        strict: a test that no longer meets the ego fails, too.
        trust: use assertions that only the files name.
        quiet: no progress, and the last line only.
    """

    tests: Sequence[Path]
    ego: str
    ego_param: Params = field(default_factory=dict)
    testers: str = "recorded"
    junit: Path | None = None
    jobs: int = 1
    strict: bool = False
    trust: bool = False
    quiet: bool = False


def check_regress(wanted: RegressOptions) -> None:
    """Refuse wrong numbers, names and files."""
    if wanted.jobs < 1:
        raise InputError(f"regress: --jobs: expected at least 1, got {wanted.jobs}")
    check_ego(wanted.ego, wanted.ego_param)
    if wanted.junit is not None:
        check_folder("--junit", wanted.junit)
    for file in wanted.tests:
        if file.suffix != CAVTEST:
            raise InputError(f"regress: {str(file)!r}: expected a name that ends in {CAVTEST}")
        if not file.is_file():
            raise InputError(f"regress: no such file: {str(file)!r}")
