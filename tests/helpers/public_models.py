"""The problems of demos and validation as `frames.Model`, in their smallest useful size."""

from __future__ import annotations

import sys
from pathlib import Path

import greco
import numpy as np
from frames import Hold, Model
from interfaces import bowl
from manufactured_scenes import on_rigid
from problems import COMM

from meshes import half_ring as ring_scene
from meshes import ironing as ironing_scene
from meshes import shells as shell_scene
from meshes.scenes import cylinder_on_block, two_blocks, two_spheres
from raymortar import AugmentedLagrangian, Coulomb, Search

for folder in ("demos", "benchmarks"):
    sys.path.insert(0, str(Path(__file__).parents[2] / folder))

import press_fit  # noqa: E402
import shells  # noqa: E402
from models import half_ring  # noqa: E402
from models import hertz_cylinder  # noqa: E402
from models import hertz_sphere  # noqa: E402
from models import shallow_ironing  # noqa: E402

E_RING = half_ring.E_INNER, half_ring.E_OUTER, half_ring.E_BLOCK
CYLINDER = hertz_cylinder.SMALL


def up(value):
    """A displacement in 2D along y."""
    return lambda t: (0.0, t * value)


def hertz_2d():
    """Pressed by a displacement of the cut, as the demo's first steps."""
    force = hertz_cylinder.force_of(CYLINDER.half_width, CYLINDER.radius)
    return Model(
        lambda: cylinder_on_block(
            COMM,
            "quadrilateral",
            radius=CYLINDER.radius,
            block_size=CYLINDER.block,
            contact_half_width=CYLINDER.half_width,
            facets_across=8,
            growth=1.5,
        ),
        (
            Hold("symmetry_x", (0,)),
            Hold("bottom", (0, 1)),
            Hold("top", (1,), up(-hertz_cylinder.approach(force, CYLINDER))),
        ),
        (0.25, 1.0),
        {"lower": hertz_cylinder.E_BLOCK, "upper": hertz_cylinder.E_CYLINDER},
        material="linear",
    )


def hertz_3d():
    push = hertz_sphere.PUSH
    return Model(
        lambda: two_spheres(
            COMM,
            radius=hertz_sphere.RADIUS,
            contact_half_width=hertz_sphere.HERTZ_RADIUS,
            facets_across=4,
            growth=2.0,
        ),
        (
            Hold("symmetry_x", (0,)),
            Hold("symmetry_y", (1,)),
            Hold("top", (2,), lambda t: (0.0, 0.0, -push * t)),
            Hold("bottom", (2,), lambda t: (0.0, 0.0, push * t)),
        ),
        (0.5, 1.0),
        hertz_sphere.E,
        material="linear",
    )


def ironing():
    """Pressed and dragged by a few facets, half as deep as the demo."""
    return Model(
        lambda: ironing_scene.scene_of(COMM, 24),
        (
            Hold("bottom"),
            Hold("top", None, lambda t: (max(t - 1.0, 0.0), -0.5 * min(t, 1.0))),
        ),
        (0.6, 0.8, 1.0, 1.1, 1.2),
        {
            "lower": shallow_ironing.E_FOUNDATION,
            "upper": shallow_ironing.E_INDENTER,
        },
        shallow_ironing.NU,
        method=lambda unit: AugmentedLagrangian(shallow_ironing.GAMMA * unit),
        options=lambda eta: {
            "friction": Coulomb(shallow_ironing.FRICTION),
            "search": Search(reach=eta, depth=eta),
        },
        search="l2",
    )


def ring_modulus(x):
    """Young's modulus at places (n, 2): three layers."""
    r = np.hypot(x[:, 0], x[:, 1] - ring_scene.OUTER - ring_scene.GAP)
    inner, outer, block = E_RING
    return np.where(x[:, 1] < 0.0, block, np.where(r < ring_scene.MIDDLE, inner, outer))


def ring():
    """As far as the ring flattens on the block."""
    return Model(
        lambda: ring_scene.scene_of(COMM, 16),
        (
            Hold("bottom"),
            Hold("ends", None, up(-half_ring.PUSH)),
        ),
        (0.2, 0.25, 0.3),
        ring_modulus,
        half_ring.NU,
        degree=2,
        options=lambda eta: {"friction": Coulomb(half_ring.FRICTION)},
        search="l2",
    )


def press():
    """The overlap pushed out, then a push to before the wall bends."""
    return Model(
        lambda: press_fit.scene_of(COMM, 6),
        (
            Hold("pushed", (0,), lambda t: (press_fit.PUSH * t, 0.0)),
            Hold("symmetry", (1,)),
            Hold("outside", (0, 1)),
        ),
        (0.0, 0.02, 0.04),
        {"block": press_fit.E_BLOCK, "channel": press_fit.E_WALL},
        press_fit.NU,
        options=lambda eta: {"friction": Coulomb(press_fit.FRICTION)},
        search="l2",
    )


def concentric():
    """Two contact zones, quadratic surfaces."""
    return Model(
        lambda: shell_scene.scene_of(COMM, 2, 1),
        (
            Hold("x", (0,)),
            Hold("y", (1,)),
            Hold("z", (2,)),
            Hold("moved", (0, 1, 2), lambda t: (0.0, 0.0, -t)),
        ),
        (0.0, 0.5),
        {"inner": 1.0, "outer": 1.0, "plate": shells.PLATE},
        shells.NU,
        options=lambda eta: {
            "pairs": [("inner", "outer"), ("roof", "plate")],
            "search": Search(reach=3.0 * eta, depth=2.0 * eta),
        },
        search="l2",
    )


def plate():
    """Greco's plate under a fifth of its dead loads, in one step."""
    return Model(
        lambda: greco.plate("quadrilateral"),
        (Hold("right", (0,)),),
        (0.2,),
        1.3e11,
        0.2,
        "linear",
        rigid="lower",
        pressure=1e8,
        load=lambda t: t * greco.LOAD,
        loaded=("left", "top"),
        method=lambda unit: AugmentedLagrangian(greco.GAMMA * unit),
        options=lambda eta: {"friction": Coulomb(1.0)},
        search="bt",
    )


def bowls():
    """Blocks of quadratic tetrahedra that touch along a paraboloid."""
    return Model(
        lambda: two_blocks(
            COMM, 3, "tetrahedron", (3, 3, 1), (2, 2, 1), 2, interface=bowl
        ),
        (
            Hold("bottom"),
            Hold("top", None, lambda t: (0.0, 0.0, -0.05 * t)),
        ),
        (1.0,),
        options=lambda eta: {"measure": "current"},
    )


def parabola():
    """The scene of the manufactured solutions: a rigid parabola under a square."""
    return Model(
        lambda: on_rigid("triangle", 6, shake=0.2),
        (Hold("top", None, lambda t: (0.1 * t, -0.05 * t)),),
        (0.5, 1.0),
        1.0,
        material="svk",
        degree=2,
        rigid="lower",
        options=lambda eta: {"friction": Coulomb(0.3)},
    )


MODELS = {
    f.__name__: f
    for f in (
        hertz_2d,
        hertz_3d,
        ironing,
        ring,
        press,
        concentric,
        plate,
        bowls,
        parabola,
    )
}
