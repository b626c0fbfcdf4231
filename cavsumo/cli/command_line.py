"""The command ``cavsumo``: parses its options and calls a command; errors become exit statuses."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

from cavsumo import __version__
from cavsumo.cli.option_parser import OptionParser
from cavsumo.cli.options import adders
from cavsumo.errors import (
    BatchError,
    CavsumoError,
    DivergenceError,
    Exit,
    InputError,
    UnknownName,
    plain,
    sentence,
)

HYPHENATED = ("--bbox", "--ego-route", "--junction")  # options whose values may begin with "-"


def main(argv: Sequence[str] | None = None) -> int:
    """The command ``cavsumo``; returns the exit status."""
    try:
        words = _joined(sys.argv[1:] if argv is None else argv)
        parser = _parser()
        if not words:
            parser.print_help()
            return Exit.USAGE
        if words[0][:1] != "-" and words[0] not in parser.commands:
            raise UnknownName("command", words[0], parser.commands)
        options = parser.parse_args(words)
        status: int = options.command(options)
        return status
    except DivergenceError as error:
        return _refused(error, Exit.VIOLATED)
    except CavsumoError as error:
        return _refused(error, Exit.NOT_RUN if isinstance(error, BatchError) else Exit.USAGE)
    except BrokenPipeError:
        return Exit.OK
    except OSError as error:  # a path that the system does not take: too long, not readable
        if error.filename is None:
            raise
        return _refused(InputError(plain(error)), Exit.USAGE)
    except KeyboardInterrupt:
        return Exit.INTERRUPTED


def _refused(error: CavsumoError, status: Exit) -> int:
    """Say why it ends, in one sentence."""
    print(f"cavsumo: {sentence(error)}", file=sys.stderr)
    return status


def _joined(words: Sequence[str]) -> list[str]:
    """The words, with a value that begins with a hyphen tied to its option by "=".

    Western longitudes and SUMO's edges against the direction begin with one, and argparse would
    take them for options.
    """
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] in HYPHENATED and word[:1] == "-" and word[:2] != "--":
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class _PrintCompletion(argparse.Action):
    """Prints the script of a shell, and exits."""

    def __call__(self, parser: Any, _: Any, shell: Any, __: str | None = None) -> None:
        from cavsumo.cli.completion import script

        print(script(parser, shell))
        parser.exit()


def _parser() -> OptionParser:
    parser = OptionParser(
        prog="cavsumo",
        description="Which tests make this vehicle fail at this junction, are they fair, and how "
        "sure are we? Generates tests for autonomous vehicles in SUMO.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"cavsumo {__version__}")
    parser.add_argument(
        "--print-completion",
        action=_PrintCompletion,
        choices=("bash", "fish", "zsh"),
        help="print the script by which a shell completes names and options (docs/guide.md)",
    )
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for add in adders():
        add(commands)
    for sort, text in (
        ("agents", "list the tester agents"),
        ("egos", "list the vehicles under test"),
        ("assertions", "list what can be asserted"),
    ):
        listing = commands.add_parser(sort, help=text, description=text, allow_abbrev=False)
        listing.add_argument("name", nargs="?", help="show the parameters of this one")
        listing.set_defaults(command=_list, sort=sort)
    parser.commands = commands.choices
    return parser


def _list(options: argparse.Namespace) -> int:
    from cavsumo.cli.listings import listing

    print(listing(options.sort, options.name))
    return Exit.OK
