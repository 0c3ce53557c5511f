"""Two wavy grids in contact as plain arrays: zones of any size without a mesh."""

from __future__ import annotations

import dataclasses

from mpi4py import MPI
from petsc4py import PETSc

import numpy as np

from raymortar import Coulomb, _cpp
from raymortar.core.discretization.facets import facet_nodes
from raymortar.core.interface.zones import default_degree, facet_rule, segment_rules

INDEX, GLOBAL = np.int32, np.int64
FACETS = {
    "interval": (2, "2D"),
    "triangle": (3, "tets"),
    "quadrilateral": (3, "hexes"),
}


def height(x):
    """Of the common surface over lateral points (n, 1 or 2) of the unit square."""
    return 0.05 * np.sin(3.0 * x[:, 0]) * np.cos(2.0 * x[:, -1])


@dataclasses.dataclass
class Grid:
    """Nodes (n, d) and facets (facets, nodes) of a structured surface."""

    X: np.ndarray
    facets: np.ndarray
    corners: int


def grid(shape, degree, n, up):
    """Surface of n cells per direction over the unit square.

    Parameters
    ----------
    shape
        Facet shape; a cell makes one quadrilateral or two triangles.
    degree
        Of nodes and displacement.
    n
        Cells per direction.
    up
        Whether normals point up.
    """
    gdim, _ = FACETS[shape]
    tdim = gdim - 1
    points = np.atleast_2d(facet_nodes(shape, degree)).reshape(-1, tdim)
    halves = [points, 1.0 - points] if shape == "triangle" else [points]
    local = np.rint(degree * np.stack(halves)).astype(np.int64)
    cells = np.stack(
        np.meshgrid(*[np.arange(n)] * tdim, indexing="xy"), axis=-1
    ).reshape(-1, 1, 1, tdim)
    width = degree * n + 1
    number = (degree * cells + local[None]) @ width ** np.arange(tdim)
    last = degree * n
    lattice = np.stack(np.meshgrid(*[np.arange(width)] * tdim, indexing="xy"), -1)
    lattice = lattice.reshape(-1, tdim).astype(np.float64)
    # Normals of increasing parameters point down in 2D and up in 3D
    if up == (tdim == 1):
        lattice[:, 0] = last - lattice[:, 0]
    x = lattice / last
    X = np.column_stack([x, height(x)])
    corners = {"interval": 2, "triangle": 3, "quadrilateral": 4}[shape]
    return Grid(X, number.reshape(-1, len(points)).astype(INDEX), corners)


def surface(shape, degree, g, first_row):
    """C++ surface with displacement rows counted from `first_row`."""
    dim = g.X.shape[1]
    return _cpp.Surface(
        shape=getattr(_cpp.Shape, shape),
        degree=degree,
        node_degree=degree,
        gdim=dim,
        X=g.X,
        facet_nodes=g.facets,
        facet_dofs=g.facets,
        rows=first_row + np.arange(g.X.size, dtype=GLOBAL).reshape(g.X.shape),
        facet_id=np.arange(len(g.facets), dtype=GLOBAL),
    )


class Pair:
    """Slave of n cells per direction on a master of n - 1, both without a mesh.

    Augmented Lagrangian, so that rows are [slave u | master u | lam].

    Attributes
    ----------
    zone
        C++ zone, not yet paired.
    facets
        Number of slave facets.
    size
        Rows.
    """

    def __init__(self, shape, degree, n, strategy="bvh", friction=False):
        dim, _ = FACETS[shape]
        slave = grid(shape, degree, n, up=False)
        master = grid(shape, degree, max(n - 1, 1), up=True)
        self.slave, self.master, self.dim = slave, master, dim
        self.facets = len(slave.facets)
        q = degree if dim == 2 else 1
        own = slave.facets if q == degree else slave.facets[:, : slave.corners]
        nodes, table = np.unique(own, return_inverse=True)
        rows_u = dim * (len(slave.X) + len(master.X))
        components = dim if friction else 1
        self.size = rows_u + components * len(nodes)
        rule = default_degree([(shape, degree)] * 2, q)
        h = np.sqrt(2.0) / n
        self._surfaces = (
            surface(shape, degree, slave, 0),
            surface(shape, degree, master, dim * len(slave.X)),
        )
        self._distances = _cpp.SearchDistances(2 * h, 2 * h, 0.5 * h)
        self._strategy = getattr(_cpp.Strategy, strategy.replace("-", "_"))
        made_of = _cpp.ZoneInput(
            slave=self._surfaces[0],
            master=self._surfaces[1],
            tools=[],
            master_node_ids=np.arange(len(master.X), dtype=GLOBAL),
            master_dof_ids=np.arange(len(master.X), dtype=GLOBAL),
            multipliers=_cpp.Multipliers(
                degree=q,
                components=components,
                facet=table.reshape(own.shape).astype(INDEX),
                rows=rows_u + components * np.arange(len(nodes), dtype=GLOBAL),
            ),
            method=_cpp.Method.augmented_lagrangian,
            condition=_cpp.Condition.points,
            friction=Coulomb(0.3).cpp() if friction else None,
            measure=_cpp.Measure.reference,
            frame=_cpp.LawFrame.automatic,
            keeps_springs=True,
            moving_segments=False,
            dual_multiplier=False,
            tie=None,
            distances=self._distances,
            strategy=self._strategy,
            subdivide=False,
            segment_rules=segment_rules(shape, rule),
            facet_rule=facet_rule(shape, rule),
            filter=None,
        )
        self.zone = _cpp.Zone(MPI.COMM_SELF.py2f(), made_of)
        # Compression: along the axis, up, or the normal component
        lam = np.zeros((len(nodes), components))
        lam[:, -1] = 1.0 if friction else -1.0
        self.zone.set_multiplier(lam.ravel())
        self.move(0.0)

    def move(self, by):
        """Displace the slave rigidly by a length in every direction."""
        self.zone.set_displacement(
            np.full(self.slave.X.size, by), np.zeros(self.master.X.size)
        )

    def candidates(self):
        """Search alone; number of candidate pairs."""
        return _cpp.find_candidates(*self._surfaces, self._distances, self._strategy)

    def matrix(self):
        """Matrix with room for the present pairs. None of it is the volume's."""
        A = PETSc.Mat().create(MPI.COMM_SELF)
        A.setSizes((self.size, self.size))
        A.setType(PETSc.Mat.Type.AIJ)
        pattern = _cpp.Pattern()
        pattern.extend(self.zone)
        none = np.zeros(1, dtype=np.int32)
        _cpp.preallocate(A.handle, none, none[:0], [self.zone], [pattern])
        return A
