"""The scenes that all programs solve: patch, Hertz in 2D and 3D, blocks, ironing."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

from mpi4py import MPI

import numpy as np
from peer_case import Case, Found

from meshes import ironing as iron
from meshes.hertz import cylinder_on_block, sphere_on_plane
from meshes.scenes import two_blocks

COMM = MPI.COMM_SELF
# Forces of fine meshes, which `run.py --references` finds
REFERENCES = Path(__file__).parent / "references.json"


def forces_error(name: str, case: Case, found: Found) -> float:
    """Of forces at the times of the reference, relative in L2."""
    reference = json.loads(REFERENCES.read_text())[name]
    exact = np.array(reference["forces"])
    own = [
        np.interp(reference["times"], found.times, found.forces[:, k])
        for k in range(case.dim)
    ]
    return float(np.linalg.norm(np.transpose(own) - exact) / np.linalg.norm(exact))


# Two cubes on meshes that do not match, of one material, pressed by a strain so small
# that it does not matter which law and which area are meant
PATCH_MODULUS, PATCH_STRAIN, PATCH_NU = 1000.0, 1e-4, 0.3


def patch(n: int, degree: int, more: int = 1, cell: str = "hexahedron") -> Case:
    """Uniform pressure, E times the strain; `n` + 1 and `n` cells of an edge."""
    scene = two_blocks(
        COMM, 3, cell, (n, n, n), (n + 1, n + 1, n + 1), perturb_sides=0.25, seed=3
    )
    sides = [f"{body}_{side}" for body in ("lower", "upper") for side in _SIDES]
    held = [("bottom", 2)] + [(name, i) for name, i in zip(sides, (0, 1) * 2)]
    push, pressure = 2.0 * PATCH_STRAIN, PATCH_MODULUS * PATCH_STRAIN

    def error(case: Case, found: Found) -> float:
        return float(np.abs(found.p / pressure - 1.0).max())

    return Case(
        scene,
        degree,
        {"lower": PATCH_MODULUS, "upper": PATCH_MODULUS},
        PATCH_NU,
        "slave",
        "master",
        tuple(held),
        "top",
        lambda t: (None, None, -push * t),
        ((1.0, more),),
        error,
        gamma=PATCH_MODULUS * n,
        release=0.5,
        force=1e-10 * pressure,
    )


_SIDES = ("left", "front")

# Steel on aluminium (mm, MPa); departures from Hertz's half-spaces are in proportion to
# the half-width, by dimension
E_ROUND, E_FLAT, NU, RADIUS = 210e3, 70e3, 0.3, 10.0
HALF_WIDTHS = {2: 0.1, 3: 0.4}
E_STAR = 1.0 / ((1.0 - NU**2) * (1.0 / E_ROUND + 1.0 / E_FLAT))


def hertz(dim: int, n: int, degree: int, more: int = 1) -> Case:
    """A cylinder or a ball on a block, which is the master: `n` facets across."""
    width = HALF_WIDTHS[dim]
    make = cylinder_on_block if dim == 2 else sphere_on_plane
    scene = make(
        COMM,
        geometry_degree=degree,
        radius=RADIUS,
        block_size=(60.0,) * (dim - 1) + (30.0,),
        contact_half_width=width,
        facets_across=n,
        master_ratio=0.8,
        growth=1.2 if dim == 2 else 1.4,
    )
    held = [("bottom", i) for i in range(dim)] + [("symmetry_x", 0)]
    held += [("symmetry_y", 1)] if dim == 3 else []
    push = width**2 / RADIUS
    if dim == 2:
        force = np.pi * E_STAR * width**2 / (4.0 * RADIUS)
        above = (2.0 * np.log(4.0 * RADIUS / width) - 1.0) / E_ROUND
        below = (2.0 * np.log(60.0 / width) - NU / (1.0 - NU)) / E_FLAT
        push = force * (1.0 - NU**2) / np.pi * (above + below)

    def error(case: Case, found: Found) -> float:
        """Of the pressure, against Hertz's for the force that was found."""
        total = 2.0 * (dim - 1) * found.forces[-1, -1]
        if dim == 2:
            a = np.sqrt(4.0 * total * RADIUS / (np.pi * E_STAR))
            peak = 2.0 * total / (np.pi * a)
        else:
            a = np.cbrt(0.75 * total * RADIUS / E_STAR)
            peak = 1.5 * total / (np.pi * a**2)
        s = np.linalg.norm(found.x[:, :-1], axis=1) / a
        return case.unlike(found, peak * np.sqrt(np.maximum(0.0, 1.0 - s**2)))

    # The square of time, so that the contact grows evenly from step to step
    return Case(
        scene,
        degree,
        {"upper": E_ROUND, "lower": E_FLAT},
        NU,
        "slave",
        "master",
        tuple(held),
        "top",
        lambda t: (None,) * (dim - 1) + (-push * t**2,),
        ((1.0, 4 * more),),
        error,
        gamma=E_FLAT * n / (2.0 * width),
        release=0.5 * RADIUS,
        force=1e-10 * E_FLAT * width ** (dim - 1),
    )


def blocks(n: int, degree: int, more: int = 1) -> Case:
    """A block on a wider one, pressed by a tenth of its height and sheared until it
    slides, friction 0.3; `n` cells along the upper one."""
    below = (round(2.5 * n), round(1.5 * n), max(2, n // 2))
    scene = two_blocks(
        COMM, 3, "hexahedron", below, (n, n, max(2, n // 2)),
        lower_size=(2.0, 1.2, 0.5), upper_size=(1.0, 1.0, 0.5), overhang=(-0.2, 0.0),
    )  # fmt: skip
    return Case(
        scene,
        degree,
        {"lower": 1.0, "upper": 3.0},
        0.3,
        "slave",
        "master",
        tuple(("bottom", i) for i in range(3)),
        "top",
        lambda t: (0.2 * max(t - 1.0, 0.0), 0.0, -0.05 * min(t, 1.0)),
        ((1.0, 3 * more), (2.0, 6 * more)),
        partial(forces_error, "blocks"),
        law="neo-hookean",
        friction=0.3,
        gamma=float(n),
        release=0.5,
        force=1e-10,
    )


def ironing(n: int, degree: int, more: int = 1) -> Case:
    """Shallow ironing, friction 0.3: `n` cells along the block, a fifth of them under
    the foot; down until time 1, then along for a fifth of the demo's way."""
    found = iron.scene_of(COMM, n, n // 5)
    found.bodies.update({"lower": 1, "upper": 2})
    return Case(
        found,
        degree,
        {"lower": 689.6, "upper": 6896.0},
        0.32,
        "slave",
        "master",
        (("bottom", 0), ("bottom", 1)),
        "top",
        lambda t: (10.0 * max(t - 1.0, 0.0), -min(t, 1.0)),
        ((1.0, 10 * more), (1.2, 10 * more)),
        partial(forces_error, "ironing"),
        law="neo-hookean",
        friction=0.3,
        gamma=1000.0,
        release=1.0,
        force=1e-10 * 689.6,
    )


SCENES = {
    "patch": patch,
    "hertz_2d": partial(hertz, 2),
    "hertz_3d": partial(hertz, 3),
    "blocks": blocks,
    "ironing": ironing,
}
