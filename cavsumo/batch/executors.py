"""Where episodes are played: in processes of this machine, or wherever dask has workers."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from cavsumo.batch.manner import Means
from cavsumo.batch.worker import close_all
from cavsumo.errors import InputError

CONNECT_S = 10.0  # how long to look for a scheduler, and for its first worker
EXECUTORS = ("local", "dask")


@contextmanager
def opened(means: Means) -> Iterator[tuple[Executor, int]]:
    """An executor and how many episodes it plays at a time; all is ended on leaving."""
    if means.executor == "dask":
        with _dask(str(means.scheduler)) as (executor, threads):
            yield executor, means.jobs or threads
    else:
        with local_executor(means.jobs or 1) as executor:
            yield executor, means.jobs or 1


@contextmanager
def local_executor(jobs: int) -> Iterator[Executor]:
    """Threads, each of which waits for a process of its own (``worker.play``)."""
    executor = ThreadPoolExecutor(jobs, "cavsumo")
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        close_all()  # what is still played is not wanted any more
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
