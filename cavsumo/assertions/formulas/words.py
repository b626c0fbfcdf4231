"""The text of a formula as words, and error messages with positions in it."""

from __future__ import annotations

import re
from typing import NamedTuple, NoReturn

from cavsumo.errors import InputError

MOST = 500  # words; far more than a formula needs

# Different ways to write the same.
SYNONYMS = {
    "G": "always",
    "globally": "always",
    "F": "eventually",
    "finally": "eventually",
    "X": "next",
    "H": "historically",
    "O": "once",
    "U": "until",
    "S": "since",
    "implies": "=>",
    "->": "=>",
    "iff": "<=>",
    "<->": "<=>",
    "&&": "and",
    "&": "and",
    "||": "or",
    "|": "or",
    "!": "not",
}
FUTURE, PAST = ("always", "eventually", "next"), ("historically", "once")
KEYWORDS = frozenset(
    (*SYNONYMS, *FUTURE, *PAST, "until", "since", "and", "or", "not", "true", "false", "inf")
)

_WORD = re.compile(
    r"(?P<number>(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?(?![\w.]))"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<sign><=>|<->|=>|->|<=|>=|==|!=|&&|\|\||[-+*/<>()\[\],!&|])",
    re.ASCII,
)


class Word(NamedTuple):
    """A word of a formula: number, name, sign or end."""

    sort: str
    text: str  # with synonyms replaced
    written: str
    at: int

    def __str__(self) -> str:
        return "the end" if self.sort == "end" else repr(self.written)


class Text(NamedTuple):
    """A formula as it was written.

    Attributes:
        where: name of the formula, for messages.
        text: it.
    """

    where: str
    text: str

    def place(self, at: int) -> str:
        """The position of a letter, in words."""
        line = self.text.count("\n", 0, at)
        column = at - (self.text.rfind("\n", 0, at) + 1) + 1
        lines = f"line {line + 1}, " if "\n" in self.text.strip() else ""
        return f"{self.where}: {lines}column {column}"

    def refuse(self, at: int, what: str) -> NoReturn:
        """Raise InputError that points at a letter."""
        raise InputError(f"{self.place(at)}: {what}")


def words(text: Text) -> list[Word]:
    """The words of a formula and its end; raises InputError for invalid letters."""
    found: list[Word] = []
    at, end = 0, len(text.text)
    while True:
        while at < end and text.text[at].isspace():
            at += 1
        if at == end:
            break
        match = _WORD.match(text.text, at)
        if match is None:
            text.refuse(at, _odd(text.text, at))
        written = match.group()
        understood = SYNONYMS.get(written, written)
        found.append(Word(str(match.lastgroup), understood, written, at))
        at = match.end()
        if len(found) > MOST:
            text.refuse(at, f"longer than {MOST} words")
    return [*found, Word("end", "", "", end)]


def _odd(text: str, at: int) -> str:
    """The message about letters that are not a word."""
    if text[at] == "=":
        return "got '=', equality is written '=='"
    run = re.match(r"[\w.]+", text[at:])
    if run and text[at].isascii():
        return f"expected a number or a name, got {run.group()!r}"
    return f"no formula has {text[at]!r}"
