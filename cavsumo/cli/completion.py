"""The script by which a shell completes commands, options, names and files.

The script is static: a shell that completes a word starts no Python.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import shtab

from cavsumo.cli.choices import CHOICES
from cavsumo.cli.option_parser import OptionParser
from cavsumo.model.scenario.fields import settings

FILES = ("FILE", "PART", "RESULTS")  # placeholders of options that take a file
# Sorts of names, by option, where the option is no setting.
SORTS = {"egos": "ego", "net": "network", "method": "search method"}


def script(parser: OptionParser, shell: str) -> str:
    """The script of a shell: bash, fish or zsh.

    ``parser`` is changed and parses no command line afterwards.
    """
    words = _words()
    for command in _with_commands(parser):
        for action in command._actions:
            _complete(action, words.get(_name(command, action), ()))
    return str(shtab.complete(parser, shell))


def _with_commands(parser: OptionParser) -> Iterator[OptionParser]:
    """A parser and those of its commands, with all options."""
    parser.fill_in()
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _with_commands(command)


def _words() -> Mapping[str, tuple[str, ...]]:
    """The words that an option takes, by its name in the parsed options."""
    found = {setting.key: setting.words for setting in settings() if setting.words}
    sorts = {setting.key: setting.option.choices for setting in settings()} | SORTS
    return found | {key: tuple(CHOICES[sort]()) for key, sort in sorts.items() if sort}


def _name(command: OptionParser, action: argparse.Action) -> str:
    """The name of an option, that of its setting where a listing takes one by name."""
    sort = command.get_default("sort")
    return {"egos": "ego"}.get(sort, sort) if action.dest == "name" and sort else action.dest


def _complete(action: argparse.Action, words: Iterable[str]) -> None:
    """Tell shtab what completes an option."""
    if action.dest == "net":
        action.complete = _names_and_files(words)  # type: ignore[attr-defined]
    elif action.type is Path or action.metavar in FILES:
        action.complete = shtab.FILE  # type: ignore[attr-defined]
    elif words and action.choices is None and action.nargs != 0:
        action.choices = tuple(words)


def _names_and_files(words: Iterable[str]) -> shtab.CompleteType:
    """Names of networks, and files."""
    names = " ".join(words)
    bash = f'compgen -W "{names}" -- "$1"; compgen -f -- "$1"'
    return {
        "bash": "_cavsumo_files_and_networks",
        "zsh": "_cavsumo_files_and_networks",
        "fish": f"(string split ' ' '{names}'; __fish_complete_path (commandline -ct))",
        "preamble": {
            "bash": f"_cavsumo_files_and_networks() {{ {bash}; }}",
            "zsh": f"_cavsumo_files_and_networks() {{ compadd -- {names}; _files; }}",
        },
    }
