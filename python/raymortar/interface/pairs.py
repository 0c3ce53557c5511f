"""Pairs of surfaces by tag and by name, and the pair that a point belongs to."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..checked import is_whole_number
from ..errors import ContactError
from ..rigid.body import Body, as_body
from ..rigid.shapes import Shape


@dataclass(frozen=True)
class Pair:
    """A slave surface and one of the masters that it meets.

    Attributes
    ----------
    slave, master
        Facet tags; of a rigid master its `rigid.Body`.
    slave_name, master_name
        Names of these tags, where `Contact` was given names; else None.
    surface
        Number of the slave surface, the argument of `points`.
    label
        Name in the columns of a `History`, such as ``force_<label>_x``. It joins both
        names, or tags, by ``_``, which also replaces all but letters and digits. If two
        pairs would have one label, their numbers are added.
    """

    slave: int
    master: int | Body
    slave_name: str | None
    master_name: str | None
    surface: int
    label: str

    def __str__(self) -> str:
        return "({}, {})".format(*self._shown)

    @property
    def in_other_order(self) -> str:
        """The pair with its sides exchanged, as text."""
        return "({}, {})".format(*reversed(self._shown))

    @property
    def _shown(self) -> list[str]:
        sides = (self.slave_name, self.slave), (self.master_name, self.master)
        return [str(tag) if name is None else repr(name) for name, tag in sides]


def spoken(name: str | None, tag: int | Body) -> str:
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


def read_pairs(
    pairs: Any, known: Mapping[str, Any]
) -> tuple[list[Pair], dict[int, tuple[Any, ...]]]:
    """Check pairs of names, tags and rigid shapes.

    Returns each pair once, in the order in which they were given, and the master tags,
    or rigid bodies, of each slave tag.
    """

    def number(tag: Any) -> Any:
        if not isinstance(tag, str):
            return tag
        if tag not in known:
            listed = ", ".join(map(repr, known)) or "none: pass names="
            raise ContactError(f"no facets are named {tag!r}; known names: {listed}")
        return known[tag]

    try:
        two_each = [(slave, master) for slave, master in pairs]
    except (TypeError, ValueError):
        raise ContactError(
            f"pairs must be a list of (slave tag, master tag), not {pairs!r}"
        ) from None
    if not two_each:
        raise ContactError("pairs is empty: give at least one (slave, master)")
    name_of = {int(tag): name for name, tag in reversed(list(known.items()))}
    groups: dict[int, list[Any]] = {}
    found = []
    for one, other in two_each:
        slave: Any = number(one)
        given: Any = as_body(other) or number(other)
        _check_tags(slave, given)
        is_body = isinstance(given, Body)
        slave, master = int(slave), given if is_body else int(given)
        masters = groups.setdefault(slave, [])
        _check_order(slave, master, groups)
        if master not in masters:
            masters.append(master)
            name = given.name if is_body else name_of.get(master)
            surface = list(groups).index(slave)
            found.append(Pair(slave, master, name_of.get(slave), name, surface, ""))
    return labelled(found), {slave: tuple(each) for slave, each in groups.items()}


def _check_tags(slave: Any, master: Any) -> None:
    """Raise unless both sides are tags, or the master a rigid body."""
    if as_body(slave) is not None:
        raise ContactError(
            f"{slave!r} is the slave of a pair: a rigid shape has no facets to "
            "integrate over, so it can be a master only"
        )
    for tag in (slave, master):
        if isinstance(tag, type) and issubclass(tag, (Shape, Body)):
            raise ContactError(
                f"pairs has the class rigid.{tag.__name__}, not a shape made of it, as "
                f"rigid.{tag.__name__}(...)"
            )
        if not (is_whole_number(tag) or isinstance(tag, Body)):
            raise ContactError(f"pairs has the tag {tag!r}, which is no whole number")


def _check_order(slave: int, master: Any, groups: Mapping[int, list[Any]]) -> None:
    """Raise for a pair that cannot be beside the earlier ones."""
    if slave == master:
        raise ContactError(
            f"tag {slave} is slave and master of the same pair: split it into two "
            "tags that share no vertex. Contact of a surface with itself is not "
            "offered yet"
        )
    if slave in groups.get(master, []):
        raise ContactError(
            f"pair ({master}, {slave}) is given in both orders: their contact "
            "would be counted twice"
        )
    if any(isinstance(m, Body) != isinstance(master, Body) for m in groups[slave]):
        raise ContactError(
            f"slave tag {slave} has masters with tags and rigid ones: give each kind "
            "a Contact of its own, NonlinearProblem(F, [one, other])"
        )


def labelled(pairs: Sequence[Pair]) -> list[Pair]:
    """Give each pair a label of its own."""

    def plain(name: str | None, tag: int | Body) -> str:
        return str(tag) if name is None else re.sub(r"[^0-9A-Za-z]", "_", name)

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

    def of_surface(self, surface: int, masters: Sequence[int | Body]) -> list[int]:
        """Number of the pair that a slave surface makes with each of its masters."""
        known = {p.master: k for k, p in enumerate(self.pairs) if p.surface == surface}
        return [known[master] for master in masters]

    def find(self, slave: int | str, master: int | str | Body | None) -> list[int]:
        """Find the pairs with a slave and, if one is given, a master."""
        found = []
        for k, (pair, names) in enumerate(zip(self.pairs, self._names)):
            a, b = (names.get(s) if isinstance(s, str) else s for s in (slave, master))
            # A rigid body has a name of its own
            if a == pair.slave and (
                master in (None, pair.master_name) or b == pair.master
            ):
                found.append(k)
        if not found and master is None:
            raise self.no_surface(slave)
        if not found:
            known = ", ".join(map(str, self.pairs))
            raise ContactError(
                f"there is no contact of ({slave!r}, {master!r}): pairs of (slave, "
                f"master) are {known}, and their forces those on the slave"
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
