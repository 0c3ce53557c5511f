"""Pairs of surfaces by tag and by name, and the pair that a point belongs to."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..discretization.tagged import ALL, Group
from ..errors import ContactError, described, is_whole_number
from ..hooks import hooks
from ..target import Target, as_target


@dataclass(frozen=True)
class Pair:
    """A slave surface and one of the masters that it meets.

    Attributes
    ----------
    slave, master
        Facet tags; of a rigid master its `rigid.Body`. Of a surface that meets itself
        both are the same, and ``"all"`` is every facet.
    slave_name, master_name
        Names of these tags, where `Contact` was given names; else None.
    surface
        Number of the slave surface, the argument of `points`.
    label
        Name in the columns of a `History`, such as ``force_<label>_x``. It joins both
        names, or tags, by ``_``, which also replaces all but letters and digits. If two
        pairs would have one label, their numbers are added.
    """

    slave: int | str
    master: int | str | Target
    slave_name: str | None
    master_name: str | None
    surface: int
    label: str

    def __str__(self) -> str:
        return "({}, {})".format(*self._shown)

    @property
    def is_named(self) -> bool:
        """Whether the user has named one of its sides, or both."""
        tool = self.master if isinstance(self.master, Target) else None
        named = self.master_name is not None if tool is None else tool.is_named
        return named or self.slave_name is not None

    @property
    def in_other_order(self) -> str:
        """The pair with its sides exchanged, as text."""
        return "({}, {})".format(*reversed(self._shown))

    @property
    def _shown(self) -> list[str]:
        sides = (self.slave_name, self.slave), (self.master_name, self.master)
        return [str(tag) if name is None else repr(name) for name, tag in sides]


def in_other_order(pairs: Iterable[Pair]) -> str:
    """The argument `pairs` with the sides of pairs exchanged, as text."""
    return f"pairs=[{', '.join(pair.in_other_order for pair in pairs)}]"


def spoken(name: str | None, tag: int | str | Target) -> str:
    """Name of a surface in a message: the user's, else its tag."""
    return f"tag {tag}" if name is None else repr(name)


def known_names(names: Any, facet_dim: int) -> dict[str, Any]:
    """Look up the facet tag of each name of a tag or (dimension, tag)."""
    if names is not None and not isinstance(names, Mapping):
        raise ContactError(f"names must map names to facet tags, not {names!r}")
    known = {}
    for name, group in (names or {}).items():
        parts = tuple(group) if isinstance(group, (tuple, list)) else (facet_dim, group)
        if len(parts) != 2 or not all(map(is_whole_number, parts)):
            raise ContactError(
                f"names has {group!r} for {name!r}: it must be a tag, a whole number, "
                "or (dimension, tag)"
            )
        if parts[0] == facet_dim:
            known[name] = parts[1]
    return known


def names_by_tag(known: Mapping[str, Any]) -> dict[Any, str]:
    """Name of each tag, the first where there are several."""
    return {int(tag): name for name, tag in reversed(list(known.items()))}


def read_pairs(pairs: Any, known: Mapping[str, Any]) -> tuple[list[Pair], list[Group]]:
    """Check pairs of names, tags and rigid shapes.

    Returns each pair once, in the order in which they were given, and the slave
    surfaces with their masters.
    """

    def number(tag: Any) -> Any:
        if not isinstance(tag, str):
            return tag
        if tag not in known:
            if tag == ALL:
                return ALL
            listed = ", ".join(map(repr, known)) or "none: pass names="
            raise ContactError(f"no facets are named {tag!r}; known names: {listed}")
        return known[tag]

    try:
        pairs = [(ALL, ALL)] if isinstance(pairs, str) and pairs == ALL else pairs
        two_each = [(slave, master) for slave, master in pairs]
    except (TypeError, ValueError):
        raise ContactError(
            f"pairs must be a list of (slave tag, master tag), not {described(pairs)}"
        ) from None
    if not two_each:
        raise ContactError("pairs is empty: give at least one (slave, master)")
    name_of = names_by_tag(known) | {ALL: ALL}
    # Masters by slave, and by whether the slave meets itself
    groups: dict[tuple[Any, bool], list[Any]] = {}
    found = []
    # A shape in several pairs is one body
    bodies = {id(other): as_target(other) for _, other in two_each}
    tagged = [
        (number(one), bodies[id(other)] or number(other)) for one, other in two_each
    ]
    for check in hooks.on_pairs:
        check(tagged, name_of)
    for one, other in tagged:
        slave, master = plain(one), plain(other)
        of_itself = slave == master
        masters = groups.setdefault((slave, of_itself), [])
        if master not in masters:
            masters.append(master)
            name = other.name if isinstance(other, Target) else name_of.get(master)
            surface = list(groups).index((slave, of_itself))
            found.append(Pair(slave, master, name_of.get(slave), name, surface, ""))
    return labelled(found), [
        Group(slave, tuple(each)) for (slave, _), each in groups.items()
    ]


def plain(tag: Any) -> Any:
    """Python's own number of a tag."""
    return tag if isinstance(tag, (str, Target)) else int(tag)


def as_label(name: str) -> str:
    """Replace all but letters and digits."""
    return re.sub(r"[^0-9A-Za-z]", "_", name)


def labelled(pairs: Sequence[Pair]) -> list[Pair]:
    """Give each pair a label that no other has. Bodies have names that no other has."""

    def plain(name: str | None, tag: int | str | Target) -> str:
        return str(tag) if name is None else as_label(name)

    bodies = {p.master for p in pairs if isinstance(p.master, Target)}
    given = [body.name for body in bodies if body.is_named]
    twice = sorted({name for name in given if given.count(name) > 1})
    if twice:
        raise ContactError(
            f"two rigid bodies are named {twice[0]!r}, and results go by name: give each "
            "its own, or all pairs the same body"
        )
    labels = [
        f"{plain(p.slave_name, p.slave)}_{plain(p.master_name, p.master)}"
        for p in pairs
    ]
    return [
        replace(p, label=f"{label}_{k}" if labels.count(label) > 1 else label)
        for k, (p, label) in enumerate(zip(pairs, labels))
    ]


class PairTable:
    """The pairs of one contact or several, found by surface, tag or name.

    Parameters
    ----------
    pairs
        In the order of the contacts, with slave surfaces numbered on.
    names
        Facet tag by name, of the contact of each pair.
    """

    def __init__(
        self, pairs: Sequence[Pair], names: Sequence[Mapping[str, int]]
    ) -> None:
        self.pairs, self._names = list(pairs), list(names)

    @classmethod
    def joined(cls, tables: Sequence[PairTable], surfaces: Sequence[int]) -> PairTable:
        """One table of several, given how many slave surfaces each is of."""
        pairs, names, begin = [], [], 0
        for one, count in zip(tables, surfaces):
            pairs += [replace(p, surface=begin + p.surface) for p in one.pairs]
            names += one._names
            begin += count
        return cls(labelled(pairs), names)

    def names_at(self, surface: int) -> Mapping[str, int]:
        """Facet tag by name, of the contact of a slave surface."""
        found = (n for p, n in zip(self.pairs, self._names) if p.surface == surface)
        return next(found)

    def of_surface(self, surface: int, masters: Sequence[Any]) -> list[int]:
        """Number of the pair that a slave surface makes with each master."""
        known = {p.master: k for k, p in enumerate(self.pairs) if p.surface == surface}
        return [known[master] for master in masters]

    def find(self, slave: int | str, master: int | str | Target | None) -> list[int]:
        """Find the pairs with a slave and, if one is given, a master."""
        found = []
        for k, (pair, names) in enumerate(zip(self.pairs, self._names)):
            known: dict[str, Any] = {ALL: ALL, **names}
            a, b = (known.get(s) if isinstance(s, str) else s for s in (slave, master))
            # A rigid body has its own name
            if a == pair.slave and (
                master in (None, pair.master_name) or b == pair.master
            ):
                found.append(k)
        if not found and master is None:
            raise self.no_surface(slave)
        if not found:
            listed = ", ".join(map(str, self.pairs))
            raise ContactError(
                f"there is no contact of ({slave!r}, {master!r}): pairs of (slave, "
                f"master) are {listed}, and their forces those on the slave"
            )
        return found

    def no_surface(self, slave: Any) -> ContactError:
        """The error for a slave surface that does not exist."""
        names = dict.fromkeys(p.slave_name for p in self.pairs if p.slave_name)
        named = f", or named {', '.join(map(repr, names))}" if names else ""
        last = max(p.surface for p in self.pairs)
        return ContactError(
            f"there is no slave surface {slave!r}: they are numbered from 0 to {last}, "
            f"in the order of pairs{named}"
        )
