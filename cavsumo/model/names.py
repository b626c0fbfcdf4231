"""Names of the things of one sort, known before any of them is imported."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from importlib import import_module

from cavsumo.errors import UnknownName


class Names:
    """The names of one sort, each with the module that registers what is called so.

    A table of names is checked in no time; the modules are imported when one is built.

    Args:
        sort: what has these names, such as "agent".
        package: where the modules stand.
        modules: the module of each name, within the package. That it registers that name, and
            that no other module does, is tested.
        parameters: of each of these names that has any, with blanks between; tested as well.
    """

    def __init__(
        self,
        sort: str,
        package: str = "",
        modules: Mapping[str, str] | None = None,
        parameters: Mapping[str, str] | None = None,
    ) -> None:
        self.sort = sort
        self._parameters = parameters or {}
        self._modules = {name: f"{package}.{file}" for name, file in (modules or {}).items()}
        self._others: set[str] = set()

    def __contains__(self, name: str) -> bool:
        return name in self._modules or name in self._others

    def __iter__(self) -> Iterator[str]:
        return iter(sorted({*self._modules, *self._others}))

    def add(self, name: str, module: str | None) -> None:
        """Take up a name under which something from a module is registered.

        Raises ValueError for one that is declared for another module.
        """
        if name not in self._modules:
            self._others.add(name)
        elif module != self._modules[name]:
            raise ValueError(f"{self.sort} {name!r} is registered already")

    def check(self, name: str, where: str = "") -> None:
        """Raise UnknownName with the nearest name unless there is such a one."""
        if name not in self:
            raise UnknownName(self.sort, name, self, where)

    def parameters(self, name: str) -> tuple[str, ...] | None:
        """The parameters of a declared name; None for any other."""
        return tuple(self._parameters.get(name, "").split()) if name in self._modules else None

    def load(self, name: str) -> None:
        """Import the module that registers a name, if that is known."""
        if name in self._modules:
            import_module(self._modules[name])

    @property
    def modules(self) -> Mapping[str, str]:
        """The full name of the module of each declared name."""
        return self._modules


def check_parameters(keys: Iterable[str], known: Collection[str], where: str) -> None:
    """Raise UnknownName for a key that is no parameter."""
    for key in keys:
        if key not in known:
            raise UnknownName("parameter", key, known, where)


def check_shared(keys: Iterable[str], known: Mapping[str, Collection[str]], where: str) -> None:
    """Raise UnknownName for a key that none of several has.

    ``KEY`` is for all that have it, ``NAME.KEY`` for one of them.

    Args:
        known: the parameters of each.
        where: begins the message.
    """
    shared = {key for own in known.values() for key in own}
    qualified = {f"{name}.{key}" for name, own in known.items() for key in own}
    for key in keys:
        check_parameters([key], qualified if "." in key else shared, where)
