"""Points of a state, found once for all who look at it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from ..core.interface.zone_data import ZoneData


@contextmanager
def at(zones: Sequence[ZoneData]) -> Iterator[None]:
    """Find the points of a state once for all who look at it within, none of whom
    changes it."""
    new = [zone for zone in zones if zone.kept_points is None]
    for zone in new:
        zone.kept_points = {}
    try:
        yield
    finally:
        for zone in new:
            zone.kept_points = None
