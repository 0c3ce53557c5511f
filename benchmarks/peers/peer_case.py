"""A problem as every program gets it, and what every program gives back.

A `Case` is a mesh with names, materials, supports and a path. Each program has a module
with a class that follows `Program`: it is made of a case, solves it, and gives back
forces and pressures. Errors are measured here, by the same code for all of them.
"""

from __future__ import annotations

import dataclasses
import functools
import typing
from collections.abc import Callable
from typing import Any

import numpy as np
from dolfinx import fem
from scipy.spatial import cKDTree

from raymortar import tools
from raymortar.core import compat

# Places in DOLFINx's row of a cell's dofs: corners around a face, then the middles of
# the edges (k, k + 1) around a face, of the opposite face, and between the two
CORNERS = {
    "quadrilateral": (0, 1, 3, 2),
    "tetrahedron": (0, 1, 2, 3),
    "hexahedron": (0, 1, 3, 2, 4, 5, 7, 6),
}
MIDDLES = {
    "quadrilateral": (4, 6, 7, 5),
    "tetrahedron": (9, 6, 8, 7, 5, 4),
    "hexahedron": (8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 15, 14),
}
# In that order: corners next to the first that span a right-handed frame, and the order
# that mirrors a left-handed cell
_FRAMES = {"quadrilateral": (1, 3), "tetrahedron": (1, 2, 3), "hexahedron": (1, 3, 4)}
_MIRRORED = {
    "quadrilateral": (0, 3, 2, 1, 7, 6, 5, 4),
    "tetrahedron": (0, 2, 1, 3, 6, 5, 4, 7, 9, 8),
    "hexahedron": (4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11)
    + (16, 17, 18, 19),
}
# Corners of each face, in the order of Abaqus' and CalculiX's numbers of faces
FACES = {
    "quadrilateral": ((0, 1), (1, 2), (2, 3), (3, 0)),
    "tetrahedron": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
    "hexahedron": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2))
    + ((2, 6, 7, 3), (3, 7, 4, 0)),
}


@dataclasses.dataclass
class Found:
    """What a program has found: forces (n, d) on the led facets, absolute, at `times`
    (n,); places (m, d) of slave vertices in the undeformed body and pressures (m,)
    there, positive in compression, at the end."""

    times: np.ndarray
    forces: np.ndarray
    x: np.ndarray
    p: np.ndarray


@dataclasses.dataclass
class Effort:
    """Of a whole path: iterations, accepted increments, and how often one was cut."""

    iterations: int
    increments: int
    cutbacks: int


class Failed(RuntimeError):
    """A program ended before the path did; says why, as far as the program does."""


class Program(typing.Protocol):
    """A contact code, as its users run it on a case.

    `FORMS` names its contact formulations. It is made of a case, one of them, and
    whether it runs alike (no predictor, a direct solver, full Newton steps, as far as
    the program lets choose) or as its users run it.
    """

    FORMS: typing.ClassVar[tuple[str, ...]]

    def __init__(self, case: Case, form: str, alike: bool) -> None:
        ...

    def solve(self) -> Effort:
        """Follow the path; raises `Failed`."""

    def found(self) -> Found:
        """Forces and pressures."""

    @property
    def unknowns(self) -> int:
        """Size of the systems."""


@dataclasses.dataclass
class Case:
    """Bodies that are led into contact.

    Parameters
    ----------
    scene
        Mesh, cell tags, facet tags and names (`meshes.meshing.Scene`).
    degree
        Of the displacement.
    moduli, nu
        Young's modulus by body, Poisson's ratio.
    slave, master
        Names of the facets.
    held
        (name of facets, component) whose displacement is zero.
    led, way
        Name of the facets that are led, and their displacement by component as a
        function of time: numbers, or None where free.
    legs
        (last time, steps) of each part of the path, which starts at time 0.
    error
        Relative error of what was found.
    law
        "linear", or "neo-hookean": mu/2 (J^(-2/3) tr C - 3) + K/2 (J - 1)^2.
    friction
        Coulomb's coefficient.
    gamma, release
        For GetFEM, which has none of its own: augmentation, longest ray.
    force
        Residual [force] at which Newton's method may end, where a program asks.
    """

    scene: Any
    degree: int
    moduli: dict[str, float]
    nu: float
    slave: str
    master: str
    held: tuple[tuple[str, int], ...]
    led: str
    way: Callable[[float], tuple[float | None, ...]]
    legs: tuple[tuple[float, int], ...]
    error: Callable[[Case, Found], float]
    law: str = "linear"
    friction: float = 0.0
    gamma: float = 0.0
    release: float = 0.0
    force: float = 0.0

    @property
    def dim(self) -> int:
        """Of space."""
        return int(self.scene.mesh.geometry.dim)

    @property
    def cell(self) -> str:
        """Name of the cells."""
        return str(compat.cell_name(self.scene.mesh))

    def times(self) -> list[float]:
        """Ends of all steps."""
        found: list[float] = []
        begin = 0.0
        for end, steps in self.legs:
            found += list(np.linspace(begin, end, steps + 1)[1:])
            begin = end
        return found

    @functools.cached_property
    def space(self) -> Any:
        """Space of the displacement, in DOLFINx."""
        return tools.vector_space(self.scene.mesh, self.degree)

    @functools.cached_property
    def places(self) -> np.ndarray:
        """Of all nodes, (n, d)."""
        return self.space.tabulate_dof_coordinates()[:, : self.dim].copy()

    @functools.cached_property
    def cells(self) -> np.ndarray:
        """Nodes of each cell, right-handed, corners before the middles of edges.

        Nodes in the middles of faces and cells are left out: serendipity elements have
        none.
        """
        kind = self.cell
        order = CORNERS[kind] + (MIDDLES[kind] if self.degree == 2 else ())
        cells = np.array(compat.dofmap_array(self.space)[:, order])
        frame = self.places[cells[:, _FRAMES[kind]]] - self.places[cells[:, :1]]
        left = np.linalg.det(frame) < 0.0
        cells[left] = cells[left][:, _MIRRORED[kind][: cells.shape[1]]]
        return cells

    def nodes(self, name: str) -> np.ndarray:
        """On the facets with a name, without those that `cells` leaves out."""
        facets = self.scene.find(name)
        dofs = fem.locate_dofs_topological(self.space, self.dim - 1, facets)
        return np.intersect1d(dofs, self.cells)

    def faces(self, name: str) -> np.ndarray:
        """(cell, number of its face in `FACES`) of the facets with a name."""
        on_it = np.isin(self.cells, self.nodes(name))
        found = [
            np.column_stack([cells, np.full_like(cells, number)])
            for number, corners in enumerate(FACES[self.cell])
            for cells in [np.flatnonzero(on_it[:, corners].all(axis=1))]
        ]
        return np.vstack(found)

    def corners(self, name: str) -> np.ndarray:
        """Nodes at the corners of the facets with a name, (facets, corners)."""
        faces = np.array(FACES[self.cell])
        return np.array([self.cells[c][faces[k]] for c, k in self.faces(name)])

    @functools.cached_property
    def vertices(self) -> tuple[np.ndarray, np.ndarray]:
        """Slave vertices, and the part of the undeformed surface around each."""
        facets = self.corners(self.slave)
        x = self.places[facets]
        across = x[:, 2 % x.shape[1]] - x[:, 0] if self.dim == 3 else x[:, 1] - x[:, 0]
        if self.dim == 2:
            area = np.linalg.norm(across, axis=1)
        elif x.shape[1] == 3:
            area = np.linalg.norm(np.cross(across, x[:, 1] - x[:, 0]), axis=1) / 2.0
        else:
            area = np.linalg.norm(np.cross(across, x[:, 3] - x[:, 1]), axis=1) / 2.0
        nodes, where = np.unique(facets, return_inverse=True)
        each = np.repeat(area / facets.shape[1], facets.shape[1])
        return nodes, np.bincount(where.ravel(), each)

    def pressures(self, x: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places of the slave vertices and the pressure at each, out of values `p` at
        places `x` in any order; 0 where a program has no value."""
        nodes, _ = self.vertices
        at = self.places[nodes]
        reach, nearest = cKDTree(x).query(at)
        size = np.ptp(self.places, axis=0).max()
        return at, np.where(reach < 1e-5 * size, p[nearest], 0.0)

    def unlike(self, found: Found, exact: np.ndarray) -> float:
        """Pressure's deviation from `exact` at the slave vertices, in L2, relative."""
        _, area = self.vertices
        return float(np.sqrt(area @ (found.p - exact) ** 2 / (area @ exact**2)))
