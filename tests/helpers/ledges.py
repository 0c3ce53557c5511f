"""A block on a ledge above a floor: facets see one beside the other."""

from functools import lru_cache

from problems import COMM
from states import curved

from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks

TAGS = {"slave": 1, "master": 2}


@lru_cache(maxsize=None)
def ledge(cell, geometry_degree):
    """A block of two facets, of which one reaches over the ledge's corner."""

    def onto_curve(x):
        x = x.copy()
        x[:, 1] += curved(x) - 0.7
        return x

    top = {"top": TAGS["master"]}
    blocks = [
        Block(
            (2, 1), (0.0, 0.5), (2.0, 0.7), mapping=onto_curve, tags=top, body="ledge"
        ),
        Block((3, 1), (-1.0, 0.0), (4.0, 0.2), tags=top, body="floor"),
        Block(
            (2, 1),
            (0.9, 0.7),
            (2.6, 1.1),
            mapping=onto_curve,
            tags={"bottom": TAGS["slave"]},
            body="upper",
        ),
    ]
    mesh, cell_tags, facet_tags = assemble_blocks(COMM, blocks, cell, geometry_degree)
    return Scene(
        mesh, cell_tags, facet_tags, TAGS, {"ledge": 1, "floor": 2, "upper": 3}
    )
