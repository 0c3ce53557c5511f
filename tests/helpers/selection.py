"""The tests that a push runs. All others are for the night.

Many tests are families: one function over cells, laws, methods and measures. The
members repeat one another, so that a push takes few of them, and some of each.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from itertools import groupby
from zlib import crc32


def of_a_push(items, long_ones, ranks):
    """Items that a push runs, in their order.

    Parameters
    ----------
    items
        Items of pytest, each family together.
    long_ones
        Names of tests that a push leaves out, unless they are marked ``quick``.
    ranks
        Number of ranks. On one, each value of each parameter occurs in a family's
        choice; on several, a family has one member, not the same value everywhere.
    """
    short = [
        item
        for item in items
        if item.nodeid not in long_ones or item.get_closest_marker("quick")
    ]
    chosen = []
    for name, members in groupby(short, _family):
        members = list(members)
        if name is None:
            chosen += members
        elif ranks == 1:
            chosen += each_value(members)
        else:
            chosen.append(members[crc32(f"{name} {ranks}".encode()) % len(members)])
    return chosen


def _family(item):
    """Name of the function; None for a test without parameters."""
    if not hasattr(item, "callspec"):
        return None
    return item.nodeid.partition("[")[0]


def each_value(members):
    """Few members with all values of all parameters, those with most new ones first."""
    values = {item: set(_values(item)) for item in members}
    missing, chosen = set().union(*values.values()), set()
    while missing:
        best = max(members, key=lambda item: len(values[item] & missing))
        chosen.add(best)
        missing -= values[best]
    return [item for item in members if item in chosen]


def _values(item):
    """Of each parameter, or group of parameters that are listed together. A case that
    is a dataclass has a value in each field."""
    params = item.callspec.params
    groups = [mark.args[0] for mark in item.iter_markers("parametrize")]
    groups = [g.replace(",", " ").split() if isinstance(g, str) else g for g in groups]
    listed = {name for group in groups for name in group}
    for group in [*groups, *([name] for name in params if name not in listed)]:
        case = params[group[0]]
        if len(group) == 1 and is_dataclass(case) and not isinstance(case, type):
            yield from ((f.name, repr(getattr(case, f.name))) for f in fields(case))
        else:
            # All members have the same objects, which need not be hashable
            yield tuple((name, id(params[name])) for name in group)
