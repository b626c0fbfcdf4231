"""The table of all settings for ``docs/settings.md``; ``python -m cavsumo.cli.settings_table``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from cavsumo.cli.setting_options import default_of, meaning, words_of
from cavsumo.model.scenario.fields import Setting, settings

HEAD = "| key | option | default | meaning |\n| --- | --- | --- | --- |"


def tables(offered: Iterable[Setting]) -> str:
    """A table for each heading of the settings, in Markdown."""
    offered = tuple(offered)
    titles = dict.fromkeys(setting.option.group for setting in offered)
    return "\n\n".join(
        "\n".join([f"### {title.capitalize()}\n", HEAD, *_rows(offered, title)]) for title in titles
    )


def keywords(offered: Iterable[Setting]) -> str:
    """The settings that the environments take as keywords."""
    return ", ".join(f"`{setting.key}`" for setting in offered if setting.environments)


def _rows(offered: Iterable[Setting], title: str) -> Iterator[str]:
    """The rows of the settings under one heading."""
    for setting in offered:
        if setting.option.group == title:
            names = ", ".join(f"`{name}`" for name in setting.names)
            cells = (f"`{setting.key}`", names, _default(setting), _meaning(setting))
            yield "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def _default(setting: Setting) -> str:
    """A default as it is written in a scenario file; one that is chosen in words."""
    if setting.option.unset:
        return setting.option.unset
    if setting.default in (None, (), {}):
        return "none"
    if isinstance(setting.default, bool):
        return f"`{str(setting.default).lower()}`"
    return f"`{default_of(setting)}`"


def _meaning(setting: Setting) -> str:
    """The meaning, with the words from which to choose."""
    words = ", ".join(f"`{word}`" for word in words_of(setting))
    return f"{meaning(setting)}: {words}" if words else meaning(setting)


if __name__ == "__main__":
    print(tables(settings()))
    print(f"\n{keywords(settings())}")
