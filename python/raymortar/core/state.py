"""The accepted step as named arrays. Copies, rollback and files are loops over them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Protocol

import numpy as np

from .compat import Array


class State(dict[str, Array]):
    """Copy of the accepted step and of the present unknowns: this rank's arrays by
    name."""


@dataclass(frozen=True)
class Quantity:
    """An array of the accepted step, which one owner has.

    Attributes
    ----------
    name
        No other array of the state has it.
    read, write
        The owner's array, or None where it has none; and what takes one over.
    by
        What numbers its rows: the space of a Function, or the zone of slave facets;
        None: all ranks have the array alike.
    shape
        Of an array that the owner may not have yet; None: as `read` gives it.
    may_lack
        Whether a state may be without it. Then `write` takes None.
    is_unknown
        Whether it is solved for.
    is_of_step
        Whether copies have it: what a step changes. Files have all.
    fault
        Says why an array cannot be taken over, if so, in place of its shape.
    """

    name: str
    read: Callable[[], Array | None]
    write: Callable[[Any], None]
    by: Any = None
    shape: tuple[int, ...] | None = None
    may_lack: bool = False
    is_unknown: bool = False
    is_of_step: bool = True
    fault: Callable[[Array], str | None] | None = None

    def fault_of(self, array: Array | None) -> str | None:
        """Return why an array of a state cannot be taken over, if so."""
        if not self.is_of_step or (array is None and self.may_lack):
            return None
        if array is not None and self.fault is not None:
            return self.fault(array)
        own = self.read()
        here = np.shape(own) if self.shape is None and own is not None else self.shape
        there = None if array is None else np.shape(array)
        return None if there == here else _other(self.name, there, here)

    def added(self, name: str) -> Quantity:
        """The same array by another name, in a state that may be older than its owner:
        then it stays as it is."""

        def write(values: Array | None) -> None:
            if values is not None:
                self.write(values)

        return replace(self, name=name, write=write, may_lack=True)


def _other(name: str, there: Any, here: Any) -> str:
    """Say that an array of a state has another shape."""
    return (
        f"the state is of another contact, mesh or method: {name} of shape {there}, "
        f"here {here}"
    )


def of_array(name: str, array: Array, by: Any = None, **more: Any) -> Quantity:
    """An array that stays the same object, whose entries change: zero for none."""

    def write(values: Array | None) -> None:
        array[:] = 0.0 if values is None else values

    return Quantity(name, lambda: array, write, by, **more)


def of_function(name: str, f: Any, **more: Any) -> Quantity:
    """The values of a Function."""
    return of_array(name, f.x.array, f.function_space, **more)


def of_part(
    name: str, owner: Any, attribute: str, places: Any, by: Any = None
) -> Quantity:
    """Some entries of an array, an attribute of its owner."""

    def write(values: Array) -> None:
        getattr(owner, attribute)[places] = values

    return Quantity(name, lambda: getattr(owner, attribute)[places], write, by)


def common(
    name: str, own: Iterable[int], fault: Callable[[Array, Array], str]
) -> Quantity:
    """Whole numbers that a state must have in common with what it is restored to.

    Of others `fault` says what both mean, given those of the state and one's own.
    """
    here = np.array(list(own), dtype=np.float64)

    def differs(there: Array) -> str | None:
        return None if np.array_equal(there, here) else fault(there, here)

    return Quantity(name, lambda: here, lambda _: None, fault=differs)


class Owner(Protocol):
    """Has arrays of a state besides contact itself."""

    def quantities(self) -> Iterable[Quantity]:
        """Its arrays, which are asked for at each copy."""


def _given(array: Array, _: Quantity) -> Array:
    return array


class Owners:
    """The owners by which the state of a problem has been extended, by name.

    Attributes
    ----------
    waiting
        Arrays that have no owner yet, as a state may be read before its owner is made:
        what finds each, given the owner's.
    lacking
        Arrays of owners that the last state did not have.
    """

    def __init__(self) -> None:
        self._owners: dict[str, Owner] = {}
        self.waiting: dict[str, Callable[[Quantity], Array]] = {}
        self.lacking: list[str] = []

    def __setitem__(self, key: str, owner: Owner) -> None:
        """Add an owner, in place of the one that had its name. Collective."""
        self._owners[key] = owner
        self.claim()

    def get(self, key: str) -> Owner | None:
        """The owner of a name, if there is one."""
        return self._owners.get(key)

    def claim(self) -> None:
        """Give owners the arrays that have waited for them. Collective."""
        for one in list(self):
            if one.name in self.waiting:
                one.write(self.waiting.pop(one.name)(one))

    def note(self, state: State) -> None:
        """Note which arrays of a state wait for their owners, and which it lacks."""
        here = {one.name: one.is_of_step for one in self}
        self.lacking = [name for name in here if here[name] and name not in state]
        for name, array in state.items():
            if self.has(name) and name not in here:
                self.waiting[name] = partial(_given, array)

    def __iter__(self) -> Iterator[Quantity]:
        for key, owner in self._owners.items():
            for one in owner.quantities():
                yield one.added(f"{key}: {one.name}")

    @staticmethod
    def has(name: str) -> bool:
        """Whether an array is of such an owner, by its name."""
        return ": " in name


def copy_of(quantities: Iterable[Quantity]) -> State:
    """Copy all arrays that there are."""
    arrays = ((one.name, one.read()) for one in quantities if one.is_of_step)
    return State((name, np.array(array)) for name, array in arrays if array is not None)


def fault_of(state: Any, quantities: Iterable[Quantity]) -> str | None:
    """Return why a state cannot be gone back to, if so."""
    if not isinstance(state, State):
        return f"state must be a State, as state() gives it, not {type(state).__name__}"
    left = {name: array for name, array in state.items() if not Owners.has(name)}
    for one in quantities:
        fault = one.fault_of(state.get(one.name))
        if fault is not None:
            return fault
        left.pop(one.name, None)
    faults = (_other(name, array.shape, None) for name, array in left.items())
    return next(faults, None)


def restore(state: State, quantities: Iterable[Quantity]) -> None:
    """Give all owners their arrays of a state that has no fault. Collective."""
    for one in quantities:
        one.write(state.get(one.name))
