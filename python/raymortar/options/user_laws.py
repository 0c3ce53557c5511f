"""Checks of users' laws: the arguments of their functions, and their fields."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

from dolfinx.fem import Function

from ..discretization.slave_fields import Quantity, check_function
from ..errors import ContactError

# Arguments that functions may have after the first ones, by name
OFFERED = ("x", "slip", "dt", "fields")


def further_arguments(function: Any, first: int) -> list[inspect.Parameter]:
    """Arguments of a law's function after the first ones."""
    try:
        return list(inspect.signature(function).parameters.values())[first:]
    except (TypeError, ValueError):  # some built-in functions have no signature
        return []


def offered(function: Any, first: int) -> set[str]:
    """Names of the further arguments that a function is given."""
    return {one.name for one in further_arguments(function, first)} & set(OFFERED)


def check_functions(
    owner: str,
    functions: Mapping[str, Any],
    first: Sequence[str],
    may_have: Sequence[str] = OFFERED,
    kind: str = "function",
) -> None:
    """Raise unless functions of a law take its arguments, named in their order.

    Messages name what is asked for by its `kind`, as the law's page does.
    """
    named = f"{', '.join(first[:-1])} and {first[-1]}"
    for name, function in functions.items():
        if not callable(function):
            raise ContactError(
                f"{owner}.{name} must be a {kind} of {named}, not {function!r}"
            )
        if not _takes(function, len(first)):
            raise ContactError(
                f"{owner}.{name} is a function of {_shown(function)}: it must take "
                f"{len(first)} arguments, {named}"
                + (f", and may take any of {', '.join(may_have)}" if may_have else "")
            )
        for argument in further_arguments(function, len(first)):
            kinds = argument.VAR_POSITIONAL, argument.VAR_KEYWORD
            needed = argument.default is argument.empty and argument.kind not in kinds
            if needed and argument.name not in may_have:
                raise ContactError(
                    f"{owner}.{name} has the argument {argument.name!r}: after {named} "
                    f"a law may have any of {', '.join(may_have)}"
                )


def _takes(function: Any, count: int) -> bool:
    """Whether a function takes so many arguments by their order."""
    try:
        inspect.signature(function).bind_partial(*range(count))
    except TypeError:
        return False
    except ValueError:  # no signature
        return True
    return True


def _shown(function: Any) -> str:
    """The arguments of a function, for a message."""
    return ", ".join(inspect.signature(function).parameters) or "nothing"


def check_fields(owner: str, quantity: Quantity, fields: Sequence[Any]) -> None:
    """Raise unless fields of a law are scalar Functions."""
    for one in fields:
        if not isinstance(one, Function):
            raise ContactError(f"{owner}.fields has {one!r}, which is no Function")
        check_function(quantity, one)
