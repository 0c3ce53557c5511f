"""Slip fronts on a belt around half a pulley, with and without soft contact."""

from __future__ import annotations

import contextlib
from unittest import mock

from pathing import take
from points_and_nodes import CONDITIONS
from slender import belt

import raymortar
from raymortar.paths.soft_stick import SoftStick

CELLS = 134, 268


@contextlib.contextmanager
def soft(acts):
    """Soft stick as it is, or none."""
    if acts:
        yield
        return
    with mock.patch.object(SoftStick, "_softened", lambda self: []):
        yield


def slip_fronts():
    """Tangents of the whole path, and iterations where tension begins and reverses."""
    for cells in CELLS:
        for condition in ("points", "nodes", "dual"):
            for extrapolate in (False, None):
                for acts in (False, True):
                    law = raymortar.AugmentedLagrangian(**CONDITIONS[condition])
                    path = belt(cells, method=law)
                    with soft(acts):
                        found = take(path, extrapolate=extrapolate)
                    each = [step.tangents for step in found.steps]
                    yield {
                        "cells": cells,
                        "condition": condition,
                        "extrapolate": extrapolate,
                        "soft": acts,
                        "tangents": found.tangents,
                        "first": each[0],
                        "reversal": each[4],
                        "next": each[5],
                        "other": max(each[1:4] + each[6:]),
                        "ratio": float(path.result()[0]),
                    }
