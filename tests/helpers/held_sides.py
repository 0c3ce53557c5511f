"""Blocks on a plate whose sides are held along the surface, under a load."""

from dolfinx import fem
from problems import CELLS_2D, COMM, DIMENSION, build, fix

from meshes.scenes import two_blocks
from raymortar import AugmentedLagrangian, Coulomb

PRESS = 4.0
LAWS = {
    "points": AugmentedLagrangian(),
    "nodes": AugmentedLagrangian(condition="nodes"),
    "dual": AugmentedLagrangian(condition="nodes", multiplier="dual"),
}
KINDS = [(cell, degree) for cell in CELLS_2D for degree in (1, 2)]
KINDS += [("tetrahedron", 1), ("hexahedron", 1)]


def blocks(cell, counts=(2, 4), **options):
    """A block on a wider plate, of which it may slide off."""
    dim = DIMENSION[cell]
    size = (2.0,) * (dim - 1) + (1.0,)
    return two_blocks(COMM, dim, cell, *counts, lower_size=size, **options)


def pressed(
    cell,
    degree,
    law,
    held,
    friction=0.3,
    scene=None,
    moves=None,
    **options,
):
    """A block whose slave nodes are held in some components, under a load, on a plate
    that is held throughout; `moves` are Constants by component."""
    moves = {} if moves is None else moves

    def bcs(V, scene):
        plate = fem.locate_dofs_topological(
            V, scene.mesh.topology.dim, scene.cell_tags.find(scene.bodies["lower"])
        )
        ground = fem.dirichletbc(fem.Function(V), plate)
        return [ground, *(fix(V, scene, "slave", i, moves.get(i, 0.0)) for i in held)]

    scene = blocks(cell) if scene is None else scene
    return build(
        scene,
        degree,
        method=LAWS[law],
        friction=None if friction is None else Coulomb(friction),
        bcs=bcs,
        loaded=["top"],
        **({"load": -PRESS} | options),
    )


def split(case, n):
    """Pressure and tangential force on the slave, by the unit normal of the plate."""
    force = case.contact.resultant(0).force
    return force @ n, force - (force @ n) * n
