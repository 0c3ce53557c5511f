"""The tests that a push runs. All others are for the night.

Many tests are families: one function over cells, laws, methods and measures. The
members repeat one another, so that a push takes few of them, and some of each.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from itertools import groupby
from zlib import crc32

# A longer list of cases is a product, of which values count and not cases
LONG = 6
# Of the plane and of space, simplices and not
PAIRS = {"triangle", "hexahedron"}, {"quadrilateral", "tetrahedron"}


def of_a_push(items, long_ones, ranks):
    """Items that a push runs, in their order.

    Parameters
    ----------
    items
        Items of pytest, each family together.
    long_ones
        Names of tests that a push leaves out, unless they are marked ``quick``, and of
        families of which it runs two members.
    ranks
        Number of ranks. On one, each value of each parameter occurs in a family's
        choice, but two of the four cells; on several, a family has one member. Cells and
        members are not the same everywhere.
    """
    short = [item for item in items if item.nodeid not in long_ones or _is_quick(item)]
    chosen = []
    for name, members in groupby(short, _family):
        members = list(members)
        if name is None:
            chosen += members
        elif ranks == 1:
            chosen += (two if name in long_ones else each_value)(members)
        else:
            chosen.append(_any(members, f"{name} {ranks}"))
    return chosen


def of_each_file(items, long_ones, ranks):
    """Of each file's functions every fourth, and all for which ranks are the subject.

    Those of a file have one subject, and all of them run on one rank. A function of
    which a member is long runs where the file has no other; none, where the long ones
    name the file, of which each function follows a long path. All run that are marked
    ``many_ranks``, and on 2 ranks those marked ``quick``, which `scripts/test --quick`
    asks for there.
    """
    thinned = [
        item
        for item in items
        if not (
            item.get_closest_marker("many_ranks") or (ranks == 2 and _is_quick(item))
        )
    ]
    long = {name.partition("[")[0] for name in long_ones}
    kept = set()
    for file, found in groupby(thinned, lambda item: item.nodeid.partition("::")[0]):
        if file in long_ones:
            continue
        names = list(dict.fromkeys(map(_function, found)))
        kept.update([name for name in names if name not in long][::4] or names[:1])
    left_out = {item for item in thinned if _function(item) not in kept}
    return [item for item in items if item not in left_out]


def _is_quick(item):
    return item.get_closest_marker("quick") is not None


def _function(item):
    return item.nodeid.partition("[")[0]


def _any(members, name):
    """A member, not the same of all families."""
    return members[crc32(name.encode()) % len(members)]


def _family(item):
    """Name of the function; None for a test without parameters."""
    return _function(item) if hasattr(item, "callspec") else None


def two(members):
    """A member and the one that has least in common with it."""
    first = _any(members, _function(members[0]))
    at, values = members.index(first), set(_values(first))
    other = min(
        members,
        key=lambda item: (
            len(values.intersection(_values(item))),
            -abs(members.index(item) - at),
        ),
    )
    return [item for item in members if item in (first, other)]


def each_value(members):
    """Few members with all values of all parameters, those with most new ones first."""
    apart = len(members) > LONG
    values = {item: set(_values(item, apart)) for item in of_two_cells(members)}
    members = list(values)
    missing, chosen = set().union(*values.values()), set()
    while missing:
        best = max(members, key=lambda item: len(values[item] & missing))
        chosen.add(best)
        missing -= values[best]
    return [item for item in members if item in chosen]


def of_two_cells(members):
    """Of a family over all four cells, those of a plane one and of one of space, unless
    another parameter lacked a value then."""
    pair = PAIRS[crc32(_function(members[0]).encode()) % len(PAIRS)]
    chosen = [item for item in members if item.callspec.params.get("cell") in pair]
    cells = {item.callspec.params["cell"] for item in members if chosen}
    if cells != set().union(*PAIRS) or _but_cells(chosen) != _but_cells(members):
        return members
    return chosen


def _but_cells(members):
    """Values of all parameters other than the cell."""
    params = [item.callspec.params.items() for item in members]
    return {
        (name, id(value)) for one in params for name, value in one if name != "cell"
    }


def _values(item, apart=True):
    """Of each parameter, or, unless apart, group of parameters that are listed together.
    A case that is a dataclass has a value in each field."""
    params = item.callspec.params
    groups = [mark.args[0] for mark in item.iter_markers("parametrize")]
    groups = [g.replace(",", " ").split() if isinstance(g, str) else g for g in groups]
    if apart:
        groups = [[name] for group in groups for name in group]
    listed = {name for group in groups for name in group}
    for group in [*groups, *([name] for name in params if name not in listed)]:
        case = params[group[0]]
        if len(group) == 1 and is_dataclass(case) and not isinstance(case, type):
            yield from ((f.name, repr(getattr(case, f.name))) for f in fields(case))
        else:
            # All members have the same objects, which need not be hashable
            yield tuple((name, id(params[name])) for name in group)
