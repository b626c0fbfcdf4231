"""Where episodes are played: in processes of this machine, or wherever dask has workers."""

from __future__ import annotations

import importlib.util
import logging
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from cavsumo.batch.worker import Worker, close_all, join_group
from cavsumo.errors import InputError

CONNECT_S = 10.0  # how long to look for a scheduler, and for its first worker
EXECUTORS = ("local", "dask")


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
        if not (ours or isinstance(self.executor, Executor) or _is_client(self.executor)):
            raise InputError(
                "executor: expected a concurrent.futures.Executor or a dask Client, got "
                f"{self.executor!r}"
            )
        if (ours and self.executor == "dask") != (self.scheduler is not None):
            raise InputError("--executor dask and --scheduler ADDRESS go together")
        if self.executor == "dask" and importlib.util.find_spec("distributed") is None:
            raise InputError("--executor dask needs a library: pip install 'cavsumo[dask]'")


@contextmanager
def opened(means: Means) -> Iterator[tuple[Executor, int]]:
    """An executor and how many episodes it plays at a time; what was started is ended on leaving.

    An executor of the user's is left running.
    """
    if isinstance(means.executor, str) and means.executor == "dask":
        with _dask(str(means.scheduler)) as (executor, threads):
            yield executor, means.jobs or threads
    elif isinstance(means.executor, Executor):
        yield means.executor, means.jobs or int(getattr(means.executor, "_max_workers", 1))
    elif _is_client(means.executor):
        yield means.executor.get_executor(), means.jobs or sum(means.executor.ncores().values())
    else:
        with local_executor(means.jobs or 1) as executor:
            yield executor, means.jobs or 1


def _is_client(executor: Any) -> bool:
    """Whether this is a client of dask, which need not be installed."""
    return hasattr(executor, "get_executor") and hasattr(executor, "ncores")


@contextmanager
def local_executor(jobs: int) -> Iterator[Executor]:
    """Threads, each of which waits for a process of its own (``worker.play``)."""
    workers: set[Worker] = set()
    executor = ThreadPoolExecutor(jobs, "cavsumo", initializer=join_group, initargs=(workers,))
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        close_all(workers)  # what is still played is not wanted any more
        executor.shutdown(wait=True)


@contextmanager
def _dask(address: str) -> Iterator[tuple[Executor, int]]:
    """The workers of a dask scheduler."""
    import dask
    from distributed import Client

    dask.config.set({"distributed.comm.timeouts.connect": CONNECT_S})  # also to find it again
    connect: Any = Client
    for name in ("distributed", "distributed.client"):  # which retries aloud, for minutes
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = connect(address, timeout=CONNECT_S)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"scheduler {address!r}: cannot be reached") from error
    try:
        try:
            client.wait_for_workers(1, timeout=CONNECT_S)
        except TimeoutError as error:
            raise InputError(f"scheduler {address!r}: has no workers") from error
        yield client.get_executor(), sum(client.ncores().values())
    finally:
        client.close(timeout=CONNECT_S)
