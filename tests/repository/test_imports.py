"""What few programs need is imported when a program first asks for it."""

from __future__ import annotations

import subprocess
import sys

import pytest

import raymortar
from raymortar import fluxes, solvers

# Names in all rooms that users import, without the rooms themselves
MOST_NAMES, MOST_AT_THE_TOP = 62, 24
ROOMS = ("", "rigid", "solvers", "tools", "dynamics", "io")
# Modules of a contact's solve: the core, and of floors what judges and chooses
MOST_MODULES = 100

SOLVE = """
import sys
import raymortar
from mpi4py import MPI
import numpy as np
import ufl
from dolfinx import fem, mesh

print(*modules())
u, tags, forms, bcs = [], [], [], []
boxes = ([[0.0, 0.0], [1.0, 0.5]], [4, 2]), ([[0.1, 0.5], [0.8, 1.0]], [3, 2])
for k, (corners, cells) in enumerate(boxes):
    body = mesh.create_rectangle(
        MPI.COMM_SELF, corners, cells, mesh.CellType.quadrilateral
    )
    u.append(fem.Function(raymortar.core.compat.vector_space(body, 1), name=f"u{k}"))
    V, v = u[k].function_space, ufl.TestFunction(u[k].function_space)
    forms.append(ufl.inner(ufl.sym(ufl.grad(u[k])), ufl.grad(v)) * ufl.dx)
    met, held = (
        mesh.locate_entities_boundary(body, 1, lambda x, y=y: np.isclose(x[1], y))
        for y in (0.5, 1.0 * k)
    )
    marks = np.full(len(met), k + 1, dtype=np.int32)
    tags.append(raymortar.core.compat.meshtags(body, 1, np.sort(met), marks))
    moved = fem.Function(V)
    moved.x.array[1::2] = -0.02 * k
    bcs.append(fem.dirichletbc(moved, fem.locate_dofs_topological(V, 1, held)))
contact = raymortar.Contact(u, tags, [(2, 1)], friction=raymortar.Coulomb(0.3))
problem = raymortar.NonlinearProblem(forms, contact, bcs, u=u)
assert raymortar.SNESSolver(problem).solve()[1]
contact.advance()
print(*modules())
"""
MODULES = """
def modules():
    return [name for name in sys.modules if name.startswith("raymortar.")]
"""


def told(program):
    """The lines that a program prints in a process of its own."""
    run = [sys.executable, "-c", program]
    done = subprocess.run(run, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


def rooms_of(names):
    return {name.split(".")[1] for name in names}


@pytest.mark.quick
def test_a_plain_solve_imports_the_core_and_little_else():
    at_import, solved = (line.split() for line in told(MODULES + SOLVE)[:2])
    assert rooms_of(at_import) == {"_cpp", "core"}
    # Of tools, what turns directions alone
    floors = {"arguments", "diagnose", "entries", "results", "rigid", "setup"}
    assert rooms_of(solved) <= {"_cpp", "core", "solvers"} | floors
    assert "raymortar.rigid.shapes" not in solved
    assert len(at_import) < len(solved) <= MOST_MODULES


@pytest.mark.quick
def test_scipy_is_not_imported_before_it_is_used():
    program = "import sys, dolfinx, dolfinx.fem.petsc\nhad = set(sys.modules)\n"
    program += "import raymortar\nprint(*set(sys.modules) - had)"
    (names,) = told(program)
    late = ("scipy", "matplotlib", "difflib")
    assert [one for one in names.split() if one.split(".")[0] in late] == []


@pytest.mark.quick
def test_all_public_names_are_listed_and_found():
    assert set(raymortar.__all__) < set(dir(raymortar))
    assert all(getattr(raymortar, name) is not None for name in raymortar.__all__)
    with pytest.raises(AttributeError, match="no attribute 'Fluxes'"):
        raymortar.Fluxes


def names_of(room):
    """Public names of a room that are no rooms."""
    module = getattr(raymortar, room) if room else raymortar
    found = [name for name in module.__all__ if not hasattr(module, "__path__")]
    found += [
        name
        for name in module.__all__
        if hasattr(module, "__path__")
        and type(getattr(module, name)) is not type(raymortar)
    ]
    return found


@pytest.mark.quick
def test_public_names_are_few():
    counts = {room: len(names_of(room)) for room in ROOMS}
    assert counts[""] <= MOST_AT_THE_TOP
    assert sum(counts.values()) <= MOST_NAMES, counts


@pytest.mark.quick
@pytest.mark.parametrize(
    "package, moved",
    [(raymortar, "Flux"), (raymortar, "Status"), (solvers, "near_nullspace")],
)
def test_a_name_that_has_moved_is_found_with_a_warning(package, moved):
    place = f"raymortar[.].*{moved} now"
    with pytest.warns(DeprecationWarning, match=place) as caught:
        found = getattr(package, moved)
    assert found.__name__ == moved and caught[0].filename == __file__


@pytest.mark.quick
def test_every_name_that_has_moved_is_found():
    for package in (raymortar, solvers):
        for name in package._MOVED:
            with pytest.warns(DeprecationWarning, match=f"{name} is raymortar"):
                assert getattr(package, name) is not None
    # Kept once found, without a warning
    assert fluxes.Flux is raymortar.fluxes.flux.Flux


@pytest.mark.quick
def test_functions_are_not_hidden_by_modules_of_their_name():
    for package in (fluxes, solvers, raymortar):
        for name in package._PLACES:
            value = getattr(package, name)
            assert callable(value) or not package._PLACES[name], name
