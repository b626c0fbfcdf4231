"""Options of the command certify; the heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.values import values_of


def add_certify(commands: Any) -> None:
    """The command certify."""
    certify = commands.add_parser(
        "certify",
        help="replay a test over fresh seeds and egos; bound from below how often it triggers",
        description="Replay a test over fresh seeds and a list of egos, and bound from below, ego "
        "by ego, the probability that it triggers (Clopper and Pearson, one-sided, Bonferroni over "
        "the egos). Of a run is kept: its agent with its parameters and what it knew before that "
        "run, and where its testers started. Drawn anew: SUMO's chance, the agents' own, the "
        "sensors'. No seed of RESULTS is used. What a learner learns in an episode is forgotten "
        "after it.",
        allow_abbrev=False,
    )
    certify.add_argument("results", type=Path, metavar="RESULTS", help="the CSV of a batch")
    certify.add_argument(
        "test",
        metavar="RUN_OR_POLICY",
        help="number of a run; or an agent of the results, or another one or policy:FILE, whose "
        "starts are drawn anew",
    )
    _add_test(certify.add_argument_group("test"))
    _add_egos(certify.add_argument_group("egos"))
    batch = certify.add_argument_group("batch")
    batch.add_argument(
        "--runs", type=int, default=100, metavar="N", help="episodes an ego (default 100)"
    )
    batch.add_argument("--seed", type=int, default=1, help="of the fresh seeds (default 1)")
    batch.add_argument(
        "--apart",
        type=Path,
        action="append",
        default=[],
        metavar="RESULTS",
        help="other results whose seeds are not used either, such as those of a training",
    )
    batch.add_argument(
        "--confidence", type=float, default=0.95, metavar="C", help="of all bounds (default 0.95)"
    )
    batch.add_argument("-j", "--jobs", type=int, metavar="N", help="episodes at a time (default 1)")
    _add_output(certify.add_argument_group("output"))
    certify.set_defaults(command=_certify)


def _add_test(group: Any) -> None:
    add = group.add_argument
    add(
        "--starts",
        choices=("kept", "fresh"),
        help="where testers start: as in the run (default), or drawn anew",
    )
    add(
        "--open-loop",
        action="store_true",
        help="of a run: its recorded actions, in any situation, instead of its agent",
    )
    add(
        "--param",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="parameter of the agent in place of its own",
    )


def _add_egos(group: Any) -> None:
    add = group.add_argument
    add(
        "--egos",
        dest="egos",
        action="append",
        type=lambda text: tuple(text.split(",")),
        metavar="A,B,...",
        help="as for run --ego, or LABEL=EGO; default: that of the results, whose name also means "
        "its parameters there",
    )
    add(
        "--ego",
        dest="egos",
        action="append",
        type=lambda text: (text,),
        metavar="EGO",
        help="one more, which may hold commas",
    )
    add(
        "--ego-param",
        action="append",
        default=[],
        metavar="LABEL.KEY=VALUE",
        help="a parameter of an ego; KEY=VALUE if there is only one",
    )
    add(
        "--trust",
        action="store_true",
        help="use the ego and the assertions of the results even if they are a command to run, a "
        "module to import or an address to connect to; an ego named above needs no trust",
    )


def _add_output(group: Any) -> None:
    add = group.add_argument
    add(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="results file; FILE.csv becomes FILE-EGO.csv for each ego (default: none is kept)",
    )
    add("--resume", action="store_true", help="go on where the results end, or start")
    add("--overwrite", action="store_true", help="start again in place of what is there")
    add("--json", dest="as_json", action="store_true", help="print JSON (docs/guide.md)")
    add("--exit-zero", action="store_true", help="a violation is no failure")
    add("-q", "--quiet", action="store_true", help="no progress")


def _certify(options: argparse.Namespace) -> int:
    from cavsumo.cli.requests.certify import CertifyOptions, check_certify
    from cavsumo.model.checks import assignment

    given = values_of(options, CertifyOptions)
    given["egos"] = tuple(word for words in options.egos or () for word in words)
    given["param"] = dict(assignment("--param", word) for word in options.param)
    given["ego_param"] = dict(assignment("--ego-param", word) for word in options.ego_param)
    order = CertifyOptions(**given)
    check_certify(order)
    from cavsumo.cli.commands.certify import certify

    return certify(order)
