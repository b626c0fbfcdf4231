"""How a batch is played and what becomes of results that lie there; nothing heavy is imported."""

from __future__ import annotations

import importlib.util
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

from cavsumo.errors import InputError

EXECUTORS = ("local", "dask")


@dataclass(frozen=True)
class Manner:
    """How a run treats existing results, and what it prints.

    Attributes:
        resume: go on where they end.
        retry_errors: play the episodes again that could not be played.
        overwrite: start again even in place of an unfinished batch, or of another finished one.
        scratch: the results file is not one that the user named: a finished batch there is
            replaced, and that is said.
        quiet: no progress, no summary.
        exit_zero: exit with 0 after a violation.
    """

    resume: bool = False
    retry_errors: bool = False
    overwrite: bool = False
    scratch: bool = False
    quiet: bool = False
    exit_zero: bool = False


@dataclass(frozen=True)
class Means:
    """The means of playing episodes, which never change the results.

    Attributes:
        jobs: how many at a time; None for the executor's number.
        executor: "local" or "dask", or an existing executor: one of
            ``concurrent.futures``, or a dask ``Client``.
        scheduler: address of dask's scheduler.
    """

    jobs: int | None = None
    executor: Any = "local"
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InputError(f"jobs: expected a number of at least 1, got {self.jobs}")
        ours = isinstance(self.executor, str) and self.executor in EXECUTORS
        if not (ours or isinstance(self.executor, Executor) or is_client(self.executor)):
            raise InputError(
                "executor: expected a concurrent.futures.Executor or a dask Client, got "
                f"{self.executor!r}"
            )
        if (ours and self.executor == "dask") != (self.scheduler is not None):
            raise InputError("--executor dask and --scheduler ADDRESS go together")
        if self.executor == "dask" and importlib.util.find_spec("distributed") is None:
            raise InputError("--executor dask needs a library: pip install 'cavsumo[dask]'")


def is_client(executor: Any) -> bool:
    """Whether an object is a client of dask, which need not be installed."""
    return hasattr(executor, "get_executor") and hasattr(executor, "ncores")
