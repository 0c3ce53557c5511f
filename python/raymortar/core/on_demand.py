"""Names and functions of other modules, which are imported when they are first used.

What few programs need costs the others no time at import.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from pkgutil import resolve_name
from typing import Any


def function(place: str) -> Callable[..., Any]:
    """Stand in for a function by its full name, and import it at the first call."""

    def call(*arguments: Any) -> Any:
        return resolve_name(place)(*arguments)

    return call


def lookup(
    package: str, places: Mapping[str, str], moved: Mapping[str, str]
) -> Callable[[str], Any]:
    """The ``__getattr__`` of a package that finds names elsewhere.

    Parameters
    ----------
    package
        Name of the package.
    places
        Module of each name, relative to the package, such as ``".movie"``; "" for a
        module of the package itself. It is imported when the name is first asked for.
    moved
        Full new name of each name that has moved, which is given with a
        DeprecationWarning.
    """

    def find(name: str) -> Any:
        if name in moved:
            text = f"{package}.{name} is {moved[name]} now"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
            return resolve_name(moved[name])
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if not places[name]:
            return import_module(f".{name}", package)
        found = getattr(import_module(places[name], package), name)
        setattr(sys.modules[package], name, found)
        return found

    return find
