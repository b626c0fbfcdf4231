"""``cavsumo certify``: a test on fresh seeds against a list of egos, with proven bounds."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from cavsumo.agents.names import policy_file
from cavsumo.batch.certify.certificate import (
    TriggerCertificate,
    as_json,
    as_table,
    certified,
    sentences,
)
from cavsumo.batch.certify.ego_list import Egos, choices, opponents
from cavsumo.batch.certify.tested_policy import Subject, of_policy, of_run, settings_of
from cavsumo.batch.certify.used_seeds import Used, fresh_seed, used
from cavsumo.batch.located import located
from cavsumo.batch.manner import Manner, Means
from cavsumo.batch.playing import played
from cavsumo.batch.preflight import CheckedBatch, checked
from cavsumo.batch.prepared import PreparedBatch
from cavsumo.batch.replay import Record, prepared_again, recorded
from cavsumo.batch.summary import result_files
from cavsumo.batch.trust import check_trust
from cavsumo.cli.commands.run import announce, exit_status
from cavsumo.cli.requests.certify import CertifyOptions
from cavsumo.cli.steps import SlowSteps, say_written
from cavsumo.egos import make_ego
from cavsumo.errors import Exit, InputError
from cavsumo.model.bodies import kind_named
from cavsumo.model.labels import cast_of, labelled
from cavsumo.model.scenario import BatchPlan
from cavsumo.model.seeds import starts_generator
from cavsumo.model.study import Part, product
from cavsumo.network.recorded_starts import recorded_start
from cavsumo.results.present import present_paths
from cavsumo.results.recorded_plan import recorded_plan

FORMAT = 1  # of the JSON; raised when a key changes its meaning or goes
WIDTH = 120


class _Ready(NamedTuple):
    """The prepared parts of a certificate, after all checks."""

    batches: Sequence[CheckedBatch]
    egos: Egos
    seeds: Used
    seed: int
    subject: Subject
    record: Record | None
    manifest: Mapping[str, Any]


def certify(order: CertifyOptions) -> int:
    """Play the test and print the bounds; all checks precede the first written file."""
    means = Means(order.jobs)
    with _output(order) as output:
        with SlowSteps(quiet=order.quiet) as steps:
            ready = _ready(order, output, steps)
        subject, seeds, seed = ready.subject, ready.seeds, ready.seed
        _warn(ready)
        if not order.quiet:
            print(_first_lines(order, subject, seeds, seed), file=sys.stderr)
        ended, interrupted = played(ready.batches, means, _manner(order), announce)
        if interrupted:
            left = " --resume goes on" if order.output else ""
            print(f"cavsumo: interrupted, so nothing is certified;{left}", file=sys.stderr)
            return Exit.INTERRUPTED
        _show(order, certified(ended, ready.egos, order.confidence), subject, seeds, seed)
        if order.output is not None:
            say_written(map(result_files, ended), quiet=order.quiet)
    return exit_status(ended, interrupted, order.exit_zero)


def _ready(order: CertifyOptions, output: Path, steps: SlowSteps) -> _Ready:
    """Check and prepare everything."""
    steps.begin(f"reading {order.results}")
    plan, manifest = recorded_plan(order.results)
    if plan.suite is not None or plan.scenario.script is not None:
        raise InputError(
            f"certify: {str(order.results)!r} holds scripted tests, which are the same for every "
            "seed; play the suite with other egos, or with --vary N"
        )
    egos = opponents(order.egos, order.ego_param, plan.scenario)
    check_trust(plan.scenario, order.results, _allowed(order), ego=not order.egos)
    seeds = used([order.results, *order.apart], order.param)
    places = present_paths(plan, manifest, order.results)
    subject, record = _subject(order, plan, manifest)
    seed = fresh_seed(order.seed, order.runs, seeds.seeds)
    parts = _parts(order, manifest, subject, egos, seed)
    _check_outputs(order, parts)
    steps.begin("reading the network and looking for starts")
    places = present_paths(plan, manifest, order.results)
    ready = checked(parts, output, _manner(order), places)
    batches = [_marked(b, order, subject) for b in ready]
    _check_starts(batches, subject, record)
    return _Ready(batches, egos, seeds, seed, subject, record, manifest)


def _manner(order: CertifyOptions) -> Manner:
    """How existing results are treated, and what is printed."""
    return Manner(
        resume=order.resume,
        overwrite=order.overwrite,
        quiet=order.quiet,
        exit_zero=order.exit_zero,
    )


# Checked


def _check_outputs(order: CertifyOptions, parts: Sequence[Part]) -> None:
    """Refuse to overwrite the results that are read."""
    read = {file.resolve() for file in (order.results, *order.apart)}
    for output in [] if order.output is None else [part.output(order.output) for part in parts]:
        if output.resolve() in read:
            raise InputError(f"output {str(output)!r}: is one of the results")


def _check_starts(batches: Sequence[CheckedBatch], subject: Subject, record: Record | None) -> None:
    """Refuse starts that another ego would change."""
    for batch in batches if subject.told else ():
        for start in subject.told:
            recorded_start(batch.prepared.site, start)
    if record is None or subject.starts_seed is None or subject.told:
        return
    seed, ours = subject.starts_seed, subject.starts
    if ours is None:
        ours = _drawn(prepared_again(record), seed)
    for batch in batches:
        if _drawn(batch.prepared, seed) != list(ours):
            raise InputError(
                f"ego {batch.name}: the starts of run {record.run} cannot be kept, because they "
                "would be drawn otherwise for this ego or on these files; --starts fresh draws anew"
            )


def _drawn(prepared: PreparedBatch, seed: int) -> list[tuple[float, float, float]]:
    """The starts of testers in a prepared batch."""
    scenario = prepared.plan.scenario
    ego = make_ego(scenario.ego, scenario.ego_params).kind
    kinds = [kind_named(scenario.kind)] * scenario.testers
    starts = prepared.site.draw(kinds, ego, scenario.start_speed, starts_generator(seed))
    return [(start.x, start.y, start.o) for start in starts]


# The batches


def _allowed(order: CertifyOptions) -> frozenset[str] | None:
    """The egos that the user named; None to allow those of the results."""
    return None if order.trust else frozenset(cast_of(order.egos).values())


def _subject(
    order: CertifyOptions, plan: BatchPlan, manifest: Mapping[str, Any]
) -> tuple[Subject, Record | None]:
    """The test, and its run if it has one."""
    if not order.test.isdecimal():
        return of_policy(order.test, plan, manifest, order.results, order.param), None
    record = located(recorded(order.results, int(order.test), _allowed(order)))
    kept = order.starts != "fresh"
    return of_run(record, order.param, kept=kept, open_loop=order.open_loop), record


def _parts(
    order: CertifyOptions, manifest: Mapping[str, Any], subject: Subject, egos: Egos, seed: int
) -> list[Part]:
    """A batch for each ego."""
    try:
        return product(settings_of(subject, manifest, order.runs, seed), [choices(egos)])
    except ValueError as error:
        raise InputError(f"--egos: {error}; LABEL=EGO gives another name") from error


def _marked(batch: CheckedBatch, order: CertifyOptions, subject: Subject) -> CheckedBatch:
    """A batch whose manifest says what it certifies."""
    mark = {"certifies": {"test": subject.words, "results": str(order.results)}}
    return dataclasses.replace(batch, manifest={**batch.manifest, **mark})


@contextlib.contextmanager
def _output(order: CertifyOptions) -> Iterator[Path]:
    """The results file; in a temporary folder without ``-o``."""
    if order.output is not None:
        yield order.output
        return
    with tempfile.TemporaryDirectory(prefix="cavsumo-certify-") as folder:
        yield Path(folder) / "certify.csv"


# Said


def _warn(ready: _Ready) -> None:
    """Print warnings about the certificate on stderr."""
    manifest, record, seeds = ready.manifest, ready.record, ready.seeds
    prepared, subject = ready.batches[0].prepared, ready.subject
    for part, now in (("versions", prepared.versions), ("sha256", prepared.checksums)):
        was = manifest.get(part) or {}
        for name in sorted(was.keys() & now.keys()):
            if was[name] != now[name]:
                said = f"{part}: {name} was {was[name]}, is {now[name]}"
                print(f"cavsumo: {said}", file=sys.stderr)
    if record is not None and record.row["outcome"] not in ("held", "violated"):
        said = f"run {record.run} was no test: {record.row['outcome']}"
        print(f"cavsumo: {said}", file=sys.stderr)
    policy = policy_file(labelled(subject.agent)[1])
    for file in (*seeds.silent, *([policy] if policy else [])):
        said = f"{file} does not say from which seeds it was learned; --apart RESULTS excludes some"
        print(f"cavsumo: {said}", file=sys.stderr)


def _first_lines(order: CertifyOptions, subject: Subject, seeds: Used, seed: int) -> str:
    """The first lines: the test, and the kept and drawn parts."""
    starts = "kept" if subject.starts_seed is not None else "drawn anew"
    files = ", ".join(map(str, seeds.results))
    return (
        f"cavsumo: certify {subject.words}; its starts are {starts}\n"
        f"cavsumo: {order.runs} seeds an ego from seed {seed}, none of the {len(seeds.seeds)} of "
        f"{files}"
    )


def _show(
    order: CertifyOptions, found: TriggerCertificate, subject: Subject, seeds: Used, seed: int
) -> None:
    """Print the certificate."""
    if order.as_json:
        facts = {
            "format": FORMAT,
            "test": subject.words,
            "agent": subject.agent,
            "params": dict(subject.params),
            "starts_seed": subject.starts_seed,
            "seed": seed,
            "seeds_excluded": len(seeds.seeds),
            "results_excluded": list(map(str, seeds.results)),
        }
        print(json.dumps(facts | as_json(found), indent=1, ensure_ascii=False, allow_nan=False))
        return
    console = Console(width=WIDTH)
    console.print(as_table(found), highlight=False)
    console.print()
    for sentence in sentences(found):
        console.print(sentence, markup=False, highlight=False, soft_wrap=True)
