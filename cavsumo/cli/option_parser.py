"""``OptionParser``: argparse with errors in one sentence; some options are added when needed."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Sequence
from typing import Any, NoReturn

from cavsumo.errors import InputError, UnknownName
from cavsumo.model.gone_settings import GONE


class OptionParser(argparse.ArgumentParser):
    """argparse with errors in one sentence and exit status 2.

    Attributes:
        commands: the names of the commands, of the parser that has them.
        fill: adds the options of a command whose options are read from the scenario record, once
            that command is called; the help of all commands does without them.
    """

    commands: Collection[str] = ()
    fill: Callable[[argparse.ArgumentParser], None] | None = None

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self.fill_in()
        self._check_options(args or ())
        return super().parse_known_args(args, namespace)

    def fill_in(self) -> None:
        """Add the options that are read from the scenario record."""
        fill, self.fill = self.fill, None
        if fill is not None:
            fill(self)

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
            if name[2:] in GONE and name not in known and name[:2] == "--":
                raise InputError(f"{name}: {GONE[name[2:]].words}")
            if word[:2] == "--" and " " not in name and name not in known:
                command = self.prog.partition(" ")[2]
                long = [option for option in known if option[:2] == "--"]
                raise UnknownName("option", name, long, command)

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")
