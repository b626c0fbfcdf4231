"""A template with its style and its script as one self-contained page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cavsumo.errors import InputError

FILES = Path(__file__).parent


def render(folder: Path, name: str, **values: Any) -> str:
    """The page of ``NAME.html.j2`` in a folder, with ``NAME.css`` and ``NAME.js`` beside it.

    The template extends ``shell.html.j2``. Every value is escaped.
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([folder, FILES]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    styles = FILES / "shell.css", folder / f"{name}.css"
    return environment.get_template(f"{name}.html.j2").render(
        style="".join(file.read_text(encoding="utf-8") for file in styles),
        script=(folder / f"{name}.js").read_text(encoding="utf-8"),
        **values,
    )


def write(text: str, file: Path) -> None:
    """Write a page; raises InputError when the file cannot be written."""
    try:
        file.write_text(text, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise InputError(f"--html {str(file)!r}: {error.strerror}") from error
