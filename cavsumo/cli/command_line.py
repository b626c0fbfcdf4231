"""The command ``cavsumo``: parses its options and calls a command; errors become exit statuses."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Collection, Sequence
from typing import Any, NoReturn

from cavsumo import __version__
from cavsumo.cli.options import adders
from cavsumo.errors import BatchError, CavsumoError, DivergenceError, Exit, InputError, UnknownName

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
        print(f"cavsumo: {error}", file=sys.stderr)
        return Exit.VIOLATED
    except CavsumoError as error:
        print(f"cavsumo: {error}", file=sys.stderr)
        return Exit.NOT_RUN if isinstance(error, BatchError) else Exit.USAGE
    except BrokenPipeError:
        return Exit.OK
    except KeyboardInterrupt:
        return Exit.INTERRUPTED


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


class _OptionParser(argparse.ArgumentParser):
    """argparse with errors in one sentence and exit status 2.

    Attributes:
        commands: the names of the commands, of the parser that has them.
        fill: adds the options of a command whose options are read from the scenario record, once
            that command is called; the help of all commands does without them.
    """

    commands: Collection[str] = ()
    fill: Callable[[argparse.ArgumentParser], None] | None = None

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        fill, self.fill = self.fill, None
        if fill is not None:
            fill(self)
        self._check_options(args or ())
        return super().parse_known_args(args, namespace)

    def _check_options(self, words: Sequence[str]) -> None:
        """Raise UnknownName with the nearest option for one that this command does not have.

        argparse would first complain of a required option that was misspelt. The words after the
        name of a command are that command's.
        """
        for word in words:
            name = word.partition("=")[0]
            if word == "--" or (self._subparsers is not None and word[:1] != "-"):
                return
            known = self._option_string_actions
            if word[:2] == "--" and " " not in name and name not in known:
                command = self.prog.partition(" ")[2]
                long = [option for option in known if option[:2] == "--"]
                raise UnknownName("option", name, long, command)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")


def _parser() -> _OptionParser:
    parser = _OptionParser(
        prog="cavsumo",
        description="Which tests make this vehicle fail at this junction, are they fair, and how "
        "sure are we? Generates tests for autonomous vehicles in SUMO.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"cavsumo {__version__}")
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
