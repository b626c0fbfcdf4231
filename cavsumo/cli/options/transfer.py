"""Options of the command transfer; the heavy parts are imported when it is called."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cavsumo.cli.options.run import OTHERS, SCRATCH
from cavsumo.cli.options.values import values_of


def add_transfer(commands: Any) -> None:
    """The command transfer."""
    transfer = commands.add_parser(
        "transfer",
        help="try kept tests on other networks",
        description="Try failures on other networks: each in coordinates relative to the ego's "
        "path, at the places where it fits, with several seeds. Every episode is a row; the table "
        "says for each test at how many places it applies, and how often it fails again.",
        allow_abbrev=False,
    )
    add = transfer.add_argument
    add("tests", nargs="+", metavar="TEST", help="kept tests (.cavtest), or rows as FILE.csv:RUN")
    add(
        "-n", "--net", dest="nets", action="append", required=True, metavar="NET",
        help="a network, by name or as a file; repeat for several",
    )  # fmt: skip
    add("--ego", metavar="NAME", help="vehicle under test (default: that of each test)")
    add(
        "--ego-param", action="append", default=[], metavar="KEY=VALUE",
        help="a parameter of it; repeat for several",
    )  # fmt: skip
    add("--places", type=int, default=5, metavar="N", help="of a test on a network (default 5)")
    add("--seeds", type=int, default=3, metavar="N", help="episodes at each place (default 3)")
    add(
        "--form", choices=("zone", "phase", "both"), default="both",
        help="keep where the ego is as a pedestrian comes into its way, or when that is between "
        "two decisions of the ego, or try both (default)",
    )  # fmt: skip
    add("--seed", type=int, default=1, metavar="SEED", help="seed of the batches (default 1)")
    add(
        "--trust", action="store_true",
        help="use egos and assertions that only the files name, which may be commands or modules",
    )  # fmt: skip
    OTHERS["processes"](transfer.add_argument_group("processes").add_argument)
    OTHERS["output"](transfer.add_argument_group("output").add_argument)
    transfer.set_defaults(command=_transfer)


def _transfer(options: argparse.Namespace) -> int:
    from cavsumo.batch.manner import Manner, Means
    from cavsumo.kept.transfer_order import FORMS, TransferOrder, check_order
    from cavsumo.model.checks import assignment

    given = values_of(options, TransferOrder)
    given["ego_params"] = dict(assignment("--ego-param", word) for word in options.ego_param)
    given["forms"] = FORMS if options.form == "both" else (options.form,)
    order = TransferOrder(**given)
    check_order(order)
    manner = Manner(**values_of(options, Manner), scratch=options.output is None)
    means = Means(options.jobs, options.executor, options.scheduler)
    from cavsumo.cli.commands.transfer import transfer

    return transfer(order, Path(options.output or SCRATCH), means, manner)
