"""Executors of episodes: processes of this machine, or dask's workers."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from cavsumo.batch.manner import Means, is_client
from cavsumo.batch.worker import Worker, close_all, join_group
from cavsumo.errors import InputError

CONNECT_S = 10.0  # time limits for finding a scheduler, and its first worker


@contextmanager
def opened(means: Means) -> Iterator[tuple[Executor, int]]:
    """An executor and how many episodes it plays at a time; on leaving, started ones are ended.

    An executor of the user's is left running.
    """
    if isinstance(means.executor, str) and means.executor == "dask":
        with _dask(str(means.scheduler)) as (executor, threads):
            yield executor, means.jobs or threads
    elif isinstance(means.executor, Executor):
        yield means.executor, means.jobs or int(getattr(means.executor, "_max_workers", 1))
    elif is_client(means.executor):
        yield means.executor.get_executor(), means.jobs or sum(means.executor.ncores().values())
    else:
        with local_executor(means.jobs or 1) as executor:
            yield executor, means.jobs or 1


@contextmanager
def local_executor(jobs: int) -> Iterator[Executor]:
    """Threads, each of which waits for a process of its own (``worker.play``)."""
    workers: set[Worker] = set()
    executor = ThreadPoolExecutor(jobs, "cavsumo", initializer=join_group, initargs=(workers,))
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        close_all(workers)  # episodes that still run are no longer needed
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
