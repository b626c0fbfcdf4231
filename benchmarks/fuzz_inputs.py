"""Damaged input files and command lines, derived from whole ones, as hypothesis strategies.

A document is a tree, XML is a list of elements, a table is rows of cells: one to three places are
damaged, and one time in five the text itself as well, so that most of what a reader looks at is
still what it expects.
"""

from __future__ import annotations

import copy
import csv
import io
import json
import re
from collections.abc import Callable, Sequence
from typing import Any
from xml.etree import ElementTree

from hypothesis import strategies as st

DEPTH, DIGITS = 5000, 5000
# What JSON and TOML cannot be asked to write: put in place of these words in the text.
RAW = {
    "@lists@": "[" * DEPTH + "]" * DEPTH,
    "@open@": "[" * DEPTH,
    "@objects@": '{"a":' * DEPTH + "1" + "}" * DEPTH,
    "@digits@": "9" * DIGITS,
    "@400@": "9" * 400,
    "@long@": '"' + "x" * 300 + '"',
    "@surrogate@": '"\\ud800"',
    "@null@": '"\\u0000"',
    "@huge@": "1e999",
    "@nan@": "nan",
    "@NaN@": "NaN",
}
VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2, 10**12, 2**63, 2**64, -(2**63) - 1, 0.5, 1e308, -1e-320),
    *("", " ", "x", "none", "nan", "inf", "1e999", "-1", "0,0", "../x", "/", ".", "a.b", "true"),
    *("policy:x", "exec:true", "module:Class", "tcp:x:1", "crossing", "a=b", "é\n", "9" * 400),
    *([], {}, [[]], [None], [1, "a"], {"a": {}}, {"": 1}, [[1, 2], [3]], {"name": 1}, "x" * 5000),
    *RAW,
)
ENCODINGS = (
    *("utf-8", "UTF-16", "latin-1", "ascii", "foo-bar", "utf-7", "shift_jis", "cp037", "idna"),
    *(
        "rot13",
        "base64",
        "unicode_escape",
        "utf-8-sig",
        "iso-8859-15",
        "hz",
        "",
        "x" * 300,
        "\u00e9",
    ),
)
XML_VALUES = (
    *("", " ", "0", "-1", "1", "nan", "inf", "1e999", "-0.0", "9" * 400, "x", "x" * 300, "0,0"),
    *("0,0 0,0", "0,0 1,0", "nan,nan 1,1", "1e999,0 1,1", "0,0,0 1,1,1", "0 0", "1,2,3,4 5", "a b"),
    *("true", "passenger", "pedestrian", "all", "internal", "crossing", "walkingarea", "12.3.4"),
    *("../x", "\u2028", "é", "0x10", "1_000", "٣", "-1,-1 -1,-1", "5,5 5,5 6,6", "dead_end"),
)

Strategy = st.SearchStrategy[bytes]


def places(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The ways to all values in a document, the whole of it first."""
    found = [path]
    if isinstance(tree, dict):
        found += [p for key, value in tree.items() for p in places(value, (*path, key))]
    elif isinstance(tree, list):
        found += [p for i, value in enumerate(tree[:12]) for p in places(value, (*path, i))]
    return found


@st.composite
def documents(draw: Any, whole: Any) -> Any:
    """A document with one to three places damaged."""
    tree = copy.deepcopy(whole)
    for _ in range(draw(st.integers(1, 3))):
        path = draw(st.sampled_from(places(tree)))
        if not path:
            if draw(st.integers(0, 9)) == 0:
                return copy.deepcopy(draw(st.sampled_from(VALUES)))
            continue
        *before, last = path
        parent = tree
        for key in before:
            parent = parent[key]
        match draw(st.integers(0, 5)):
            case 0:
                del parent[last]
            case 1 if isinstance(parent, dict):
                parent[f"{last}x"] = parent.pop(last)
            case 2 if isinstance(parent, list):
                parent.insert(0, copy.deepcopy(parent[last]))
            case _:
                parent[last] = copy.deepcopy(draw(st.sampled_from(VALUES)))
    return tree


def json_text(tree: Any) -> str:
    """A document as JSON, one line."""
    return _raw(json.dumps(tree))


def toml_text(tree: Any) -> str:
    """A document as TOML, every value on one line."""
    if not isinstance(tree, dict):
        return _raw(f"a = {_toml(tree)}\n")
    return _raw(
        "".join(f"{json.dumps(str(key))} = {_toml(value)}\n" for key, value in tree.items())
    )


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(str(k))} = {_toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value)


def _raw(text: str) -> str:
    """A text with the words of ``RAW`` replaced."""
    for word, raw in RAW.items():
        text = text.replace(f'"{word}"', raw)
    return text


@st.composite
def texts(draw: Any, base: st.SearchStrategy[str]) -> bytes:
    """A text as bytes, one time in five cut, spoiled or in another encoding."""
    text = draw(base)
    data = text.encode("utf-8", "surrogatepass")
    if draw(st.integers(0, 4)):
        return data
    at = draw(st.integers(0, max(0, len(data) - 1)))
    match draw(st.integers(0, 6)):
        case 0:
            return data[:at]
        case 1:
            return data[:at] + draw(st.binary(min_size=1, max_size=4)) + data[at:]
        case 2:
            return text.encode("utf-16", "surrogatepass")
        case 3:
            return b"\xef\xbb\xbf" + data
        case 4:
            return data.replace(b"\n", b"\r")
        case 5:
            return data[:at] + data[at + draw(st.integers(1, 40)) :]
        case _:
            return data + data


def jsons(whole: Any) -> Strategy:
    """A damaged JSON document."""
    return texts(documents(whole).map(json_text))


def tomls(whole: Any) -> Strategy:
    """A damaged TOML document."""
    return texts(documents(whole).map(toml_text))


@st.composite
def _json_lines(draw: Any, lines: Sequence[Any]) -> str:
    """JSON lines of which one or two are damaged, left out, or there twice."""
    found = [json.dumps(line) for line in lines]
    for _ in range(draw(st.integers(1, 2))):
        i = draw(st.integers(0, min(len(found), len(lines)) - 1)) if draw(st.booleans()) else 0
        match draw(st.integers(0, 8)):
            case 0 if len(found) > 1:
                del found[i]
            case 1:
                found.insert(i, found[i])
            case 2:
                found[i] = ""
            case _:
                found[i] = json_text(draw(documents(lines[min(i, len(lines) - 1)])))
    return "\n".join(found) + "\n"


def json_lines(lines: Sequence[Any]) -> Strategy:
    """Damaged JSON lines."""
    return texts(_json_lines(lines))


CELLS = ("", " ", "x", "-1", "0", "1", "1.5", "nan", "inf", "1e999", "9" * 400, "²", "٣", "a,b")
MORE_CELLS = ('"', "held", "violated", "error", "../../x", "/etc/passwd", "é\n", "x" * 5000, "a=b")


@st.composite
def _tables(draw: Any, whole: str) -> str:
    """A CSV with cells, rows or columns damaged."""
    rows = list(csv.reader(io.StringIO(whole)))
    for _ in range(draw(st.integers(1, 3))):
        i = draw(st.integers(0, len(rows) - 1)) if draw(st.integers(0, 3)) else len(rows) - 1
        j = draw(st.integers(0, max(0, len(rows[i]) - 1)))
        match draw(st.integers(0, 9)):
            case 0:
                rows.insert(i, list(rows[i]))
            case 1 if len(rows) > 1:
                del rows[i]
            case 2:
                rows[i] = rows[i][:j]
            case 3:
                rows[i] = [*rows[i], "x"]
            case _ if rows[i]:
                rows[i][j] = draw(st.sampled_from(CELLS + MORE_CELLS))
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerows(rows)
    return line.getvalue()


def tables(whole: str) -> Strategy:
    """A damaged CSV."""
    return texts(_tables(whole))


@st.composite
def _xml(draw: Any, whole: str, focus: Callable[[Any], bool]) -> str:
    """XML with attributes or elements damaged, or its declaration."""
    root = ElementTree.fromstring(whole)
    parents = {child: parent for parent in root.iter() for child in parent}
    elements = [element for element in root.iter() if focus(element)]
    values = sorted({v for e in elements[:40] for v in e.attrib.values()})[:40]
    for _ in range(draw(st.integers(1, 3))):
        tag = draw(st.sampled_from(sorted({element.tag for element in elements})))
        element = draw(st.sampled_from([e for e in elements if e.tag == tag]))
        keys = sorted(element.attrib)
        match draw(st.integers(0, 9)):
            case 0 if element in parents and element in list(parents[element]):
                parents[element].remove(element)
            case 1 if element in parents:
                parents[element].append(copy.deepcopy(element))
            case 2:
                element.tag = draw(st.sampled_from(("x", "edge", "lane", "junction", "net", "osm")))
            case 3 if keys:
                del element.attrib[draw(st.sampled_from(keys))]
            case _ if keys:
                known = st.sampled_from(values) if values else st.nothing()
                value = draw(st.sampled_from(XML_VALUES) | known)
                element.set(draw(st.sampled_from(keys)), value)
    text = ElementTree.tostring(root, encoding="unicode")
    encoding = draw(st.sampled_from(ENCODINGS)) if draw(st.integers(0, 9)) == 0 else "utf-8"
    return f'<?xml version="1.0" encoding="{encoding}"?>\n{text}\n'


def xmls(whole: str, tags: str = ".*") -> Strategy:
    """Damaged XML; ``tags`` are the elements that are damaged, as a regular expression."""
    return texts(_xml(whole, lambda element: re.fullmatch(tags, element.tag) is not None))
