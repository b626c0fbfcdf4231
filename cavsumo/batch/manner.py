"""How a batch is played and what becomes of results that lie there; nothing heavy is imported."""

from __future__ import annotations

import importlib.util
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

from cavsumo.errors import InputError


@dataclass(frozen=True)
class Manner:
    """How a run treats the results that lie there, and what it says.

    Attributes:
        resume: go on where they end.
        retry_errors: play the episodes again that could not be played.
        overwrite: start again even in place of an unfinished batch.
        quiet: no progress, no summary.
        exit_zero: a violation is no failure.
    """

    resume: bool = False
    retry_errors: bool = False
    overwrite: bool = False
    quiet: bool = False
    exit_zero: bool = False


@dataclass(frozen=True)
class Means:
    """How episodes are played, which never changes what comes out.

    Attributes:
        jobs: how many at a time; None for what the executor has.
        executor: "local" or "dask", or an executor that is there already: one of
            ``concurrent.futures``, or a dask ``Client``.
        scheduler: address of dask's scheduler.
    """

    jobs: int | None = None
    executor: Any = "local"
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InputError(f"jobs: expected a number of at least 1, got {self.jobs}")
        ours = isinstance(self.executor, str)
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
    """Whether this is a client of dask, which need not be installed."""
    return hasattr(executor, "get_executor") and hasattr(executor, "ncores")
