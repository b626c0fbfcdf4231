"""Options of the command certify, checked before heavy imports."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from cavsumo.batch.certify.ego_list import opponents
from cavsumo.batch.certify.tested_names import check_test
from cavsumo.batch.manner import Means
from cavsumo.egos.names import check_ego
from cavsumo.errors import InputError
from cavsumo.model.scenario import Params
from cavsumo.results.reading import read_manifest
from cavsumo.results.recorded_plan import recorded_plan


@dataclass(frozen=True)
class CertifyOptions:
    """Options of the command.

    Attributes:
        results, test: the source of the test; a run's number or an agent.
        starts: "kept" or "fresh"; None for the default.
        open_loop: the run's recorded actions instead of its agent.
        param: parameters of the agent in place of its own.
        egos: as on the command line.
        ego_param: their parameters, ``LABEL.KEY``.
        trust: use external egos and assertions that only the results name.
        runs, seed: episodes per ego, and the seed from which theirs are drawn.
        apart: other results whose seeds are not to be used.
        confidence: of the bounds for all egos together.
        jobs: episodes at a time.
        output: results file; None keeps none.
        resume, overwrite, exit_zero, quiet: see ``Manner``.
        as_json: as JSON instead of a table.
    """

    results: Path
    test: str
    starts: str | None = None
    open_loop: bool = False
    param: Params = field(default_factory=dict)
    egos: Sequence[str] = ()
    ego_param: Params = field(default_factory=dict)
    trust: bool = False
    runs: int = 100
    seed: int = 1
    apart: Sequence[Path] = ()
    confidence: float = 0.95
    jobs: int | None = None
    output: Path | None = None
    resume: bool = False
    overwrite: bool = False
    exit_zero: bool = False
    quiet: bool = False
    as_json: bool = False


def check_certify(order: CertifyOptions) -> None:
    """Refuse wrong numbers and files, and unknown egos and agents."""
    _check_numbers(order)
    Means(order.jobs)
    plan, _ = recorded_plan(order.results)
    for ego, params in opponents(order.egos, order.ego_param, plan.scenario).values():
        check_ego(ego, params)
    for file in order.apart:
        read_manifest(file)
    if not order.test.isdecimal():
        check_test(order.test, plan, order.results)


def _check_numbers(order: CertifyOptions) -> None:
    """Refuse numbers out of range, and options that do not go together."""
    if not 0.0 < order.confidence < 1.0:
        raise InputError(f"--confidence: expected a share below 1, got {order.confidence:g}")
    if order.runs < 1:
        raise InputError(f"--runs: expected at least 1, got {order.runs}")
    if not 0 <= order.seed < 2**63:
        raise InputError(f"--seed: expected a number from 0 to 2^63 - 1, got {order.seed}")
    if order.resume and order.output is None:
        raise InputError("--resume: which results? name them with -o FILE")
    if order.open_loop and order.starts == "fresh":
        raise InputError("--open-loop: recorded actions need the starts that they were chosen for")
    if not order.test.isdecimal() and (order.open_loop or order.starts == "kept"):
        what = "--open-loop" if order.open_loop else "--starts kept"
        raise InputError(f"{what}: {order.test!r} is no run, of which actions and starts are known")
