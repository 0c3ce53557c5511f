"""Rooms that few programs need are imported when a program first asks for them."""

from __future__ import annotations

import subprocess
import sys

import pytest

import raymortar

LATE = "dynamics", "plotting", "wear", "flux", "field_problem"


@pytest.mark.quick
def test_rooms_are_imported_on_demand():
    program = f"""
import sys
import raymortar
from raymortar.core.hooks import hooks
late = ["matplotlib", *(f"raymortar.{{name}}" for name in {LATE})]
print(*[name for name in late if name in sys.modules])
print(bool(hooks.on_setup and hooks.keeper and hooks.linear_solver))
from raymortar import Flux, dynamics, plot
print(dynamics.__name__, Flux.__module__, plot.__module__)
"""
    run = [sys.executable, "-c", program]
    out = subprocess.run(run, capture_output=True, text=True, check=True).stdout
    late, hooked, found = out.splitlines()
    assert not late and hooked == "True"
    assert (
        found == "raymortar.dynamics raymortar.fluxes.flux raymortar.plotting.picture"
    )


@pytest.mark.quick
def test_all_public_names_are_listed_and_found():
    assert set(raymortar.__all__) < set(dir(raymortar))
    assert all(getattr(raymortar, name) is not None for name in raymortar.__all__)
    with pytest.raises(AttributeError, match="no attribute 'Fluxes'"):
        raymortar.Fluxes
