"""Recorded episodes played again or back in a process of their own, and compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection

from cavsumo.batch.playback import NOT_PLAYED_BACK, for_playback, played_back
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.replay import Record, Replayed, compare, prepared_again, replayed
from cavsumo.batch.worker import Worker
from cavsumo.network.site import Site
from cavsumo.results.traces import Trace

Notice = Callable[[Record, PreparedBatch], None]  # called before the record is played
Located = Callable[[Record], Record]  # the record with its files where they are now


def _unnoticed(_: Record, __: PreparedBatch) -> None:
    """No notice."""


def play_again(record: Record, notice: Notice = _unnoticed) -> tuple[Trace | None, Site]:
    """The trace of an episode played again, None where an error left none; and its place.

    Raises DivergenceError where it first differs from its record.
    """
    again, site = _compared(record, replayed, (), notice)
    return again.trace, site


def play_back(record: Record, located: Located, notice: Notice = _unnoticed) -> tuple[Record, Site]:
    """Play an episode's recorded actions and traffic back; its record, and its place.

    The record returned has the recorded plan, with its files where they are now. Raises
    DivergenceError where the playback first differs, InputError without a recording.
    """
    there = located(for_playback(record))
    _, site = _compared(there, played_back, NOT_PLAYED_BACK, notice)
    return _as_recorded(record, there), site


def _compared(
    record: Record,
    play: Callable[[Worker, Record], Replayed],
    apart: Collection[str],
    notice: Notice,
) -> tuple[Replayed, Site]:
    """An episode played by a worker of its own and compared with its record; and its place."""
    prepared = prepared_again(record)
    notice(record, prepared)
    with Worker(prepared) as worker:
        again = play(worker, record)
    compare(record, again, apart)
    return again, prepared.site


def _as_recorded(record: Record, there: Record) -> Record:
    """A record with the present paths of another one's files."""
    scenario = record.plan.scenario.placed(there.plan.scenario.places)
    return dataclasses.replace(record, plan=record.plan.model_copy(update={"scenario": scenario}))
