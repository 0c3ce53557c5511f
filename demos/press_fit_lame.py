"""Press fit of a shaft in a hub by an offset: plane stress, plane strain, axisymmetric.

Both are meshed to touch; the interference is `offset`. Lame's solution of thick rings
has the pressure between them and the stresses in both. In the plane a quarter is
meshed, 32 facets around the whole; with `axisymmetric=True` a section in (r, z), with
ends that are free, as in plane stress, or held along the axis, as in plane strain.
"""

import sys
from types import SimpleNamespace

from mpi4py import MPI

import bodies
import common
import drawing
import numpy as np
import ufl
from dolfinx import fem

import raymortar
from meshes.blocks import Block
from meshes.meshing import Scene, assemble_blocks
from raymortar import compat, io, tools
from raymortar.plotting.frames import gather

# Lengths in mm, stresses in MPa
SHAFT, HUB, LENGTH, INTERFERENCE = 50.0, 100.0, 40.0, 0.05
E, NU = 2.1e5, 0.3
TAGS = {"slave": 1, "master": 2, "bottom": 3, "left": 4, "top": 5}
NUMBERS = {"shaft": 1, "hub": 2}


# Scenes


def _arc(radius, angle):
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def _core(x):
    """From the unit square to the middle of a quarter disc of radius 1."""
    s, t = x[:, :1], x[:, 1:]
    right, up, corner = [0.5, 0.0], [0.0, 0.5], [0.4, 0.4]
    return s * (1 - t) * right + (1 - s) * t * up + s * t * corner


def _rim(first):
    """From the unit square, outwards and around, to an eighth of the rim."""

    def mapping(x):
        around = x[:, 1]
        inner = _core(
            np.column_stack([np.ones_like(around), around])
            if first
            else np.column_stack([1.0 - around, np.ones_like(around)])
        )
        outer = _arc(1.0, np.pi / 4 * (around if first else 1.0 + around))
        return (1.0 - x[:, :1]) * inner + x[:, :1] * outer

    return mapping


def quarters(comm, around=8, hub_around=10, cell="quadrilateral", geometry_degree=2):
    """Quarters of shaft and hub with so many facets on their arcs. Collective."""
    n, unit = around // 2, ((0.0, 0.0), (1.0, 1.0))

    def scaled(mapping):
        return lambda x: SHAFT * mapping(x)

    def ring(x):
        radius = SHAFT + (HUB - SHAFT) * x[:, :1]
        return radius * _arc(1.0, np.pi / 2 * x[:, 1])

    slave, master, bottom, left = (
        TAGS[k] for k in ("slave", "master", "bottom", "left")
    )
    parts = [
        ((n, n), scaled(_core), {"bottom": bottom, "left": left}, "shaft"),
        ((3, n), scaled(_rim(True)), {"right": slave, "bottom": bottom}, "shaft"),
        ((3, n), scaled(_rim(False)), {"right": slave, "top": left}, "shaft"),
        ((6, hub_around), ring, {"left": master, "bottom": bottom, "top": left}, "hub"),
    ]
    blocks = [
        Block(divisions, *unit, mapping=mapping, tags=tags, body=body)
        for divisions, mapping, tags, body in parts
    ]
    return Scene(*assemble_blocks(comm, blocks, cell, geometry_degree), TAGS, NUMBERS)


def sections(comm, size=4):
    """Shaft and hub in (r, z), with other numbers of cells along z. Collective."""
    ends = {"bottom": TAGS["bottom"], "top": TAGS["top"]}
    blocks = [
        Block(
            (size, size),
            (0.0, 0.0),
            (SHAFT, LENGTH),
            tags={**ends, "left": TAGS["left"], "right": TAGS["slave"]},
            body="shaft",
        ),
        Block(
            (6, size + 1),
            (SHAFT, 0.0),
            (HUB, LENGTH),
            tags={**ends, "left": TAGS["master"]},
            body="hub",
        ),
    ]
    return Scene(*assemble_blocks(comm, blocks, "quadrilateral"), TAGS, NUMBERS)


# Closed forms


def plane_strain_equivalent(E, nu):
    """Moduli that make plane strain of plane stress."""
    return E * (1.0 + 2.0 * nu) / (1.0 + nu) ** 2, nu / (1.0 + nu)


def pressure(interference, E_shaft, E_hub, nu_shaft, nu_hub):
    """Lame's pressure in plane stress, per radial interference. Stress."""
    b, c = SHAFT, HUB
    hub = (c**2 + b**2) / (c**2 - b**2) + nu_hub
    return interference / b / ((1.0 - nu_shaft) / E_shaft + hub / E_hub)


def exact_pressure(strain):
    """Of the demo's shaft and hub in plane stress or plane strain. Stress."""
    moduli = (E / (1.0 - NU**2), NU / (1.0 - NU)) if strain else (E, NU)
    return pressure(INTERFERENCE, moduli[0], moduli[0], moduli[1], moduli[1])


def exact_stresses(r, p):
    """Radial and hoop stress at radii."""
    ratio = SHAFT**2 / (HUB**2 - SHAFT**2)
    inside, far = r < SHAFT, (HUB / np.maximum(r, 1e-9)) ** 2
    radial = np.where(inside, -p, p * ratio * (1.0 - far))
    return radial, np.where(inside, -p, p * ratio * (1.0 + far))


# Problems


def stress(e, E, nu):
    """Hooke's law of a strain with the out-of-plane or hoop part, 3 x 3."""
    lmbda, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))
    return 2 * mu * e + lmbda * ufl.tr(e) * ufl.Identity(3)


def plane(comm, strain, size=8):
    """A quarter in plane strain or plane stress, not yet solved. Collective."""
    scene = quarters(comm, size, size + size // 4)
    V = tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    moduli = (E, NU) if strain else plane_strain_equivalent(E, NU)
    sigma = stress(bodies.small_strain(u), *moduli)
    dx = ufl.dx(metadata={"quadrature_degree": 6})
    F = ufl.inner(sigma, bodies.small_strain(v)) * dx
    bcs = [
        tools.prescribe(V, scene.find("bottom"), component=1),
        tools.prescribe(V, scene.find("left"), component=0),
    ]
    return scene, u, sigma, F, bcs, False


def axisymmetric(comm, held, size=4):
    """A section in (r, z) whose ends are held or free. Collective."""
    scene = sections(comm, size)
    V = tools.vector_space(scene.mesh, 2)
    u, v = fem.Function(V, name="displacement"), ufl.TestFunction(V)
    r = ufl.SpatialCoordinate(scene.mesh)[0]

    def strain(w):
        e = ufl.sym(ufl.grad(w))
        return ufl.as_tensor(
            [[e[0, 0], e[0, 1], 0], [e[1, 0], e[1, 1], 0], [0, 0, w[0] / r]]
        )

    sigma = stress(strain(u), E, NU)
    F = ufl.inner(sigma, strain(v)) * 2 * ufl.pi * r * ufl.dx(degree=6)
    bcs = [
        tools.prescribe(V, scene.find("left"), component=0),
        tools.prescribe(V, scene.find("bottom"), component=1),
    ]
    bcs += [tools.prescribe(V, scene.find("top"), component=1)] * held
    return scene, u, sigma, F, bcs, True


CASES = {
    "plane stress": lambda comm, size: plane(comm, False, size),
    "plane strain": lambda comm, size: plane(comm, True, size),
    "axisymmetric, free ends": lambda comm, size: axisymmetric(comm, False, size // 2),
    "axisymmetric, held ends": lambda comm, size: axisymmetric(comm, True, size // 2),
}


def mean_pressure(contact):
    """Normal traction over the slave surface. Collective."""
    points = contact.points()
    p = -np.einsum("qi,qi->q", points["traction"], points["normal"])
    sums = np.array([points["weight"] @ p, points["weight"].sum()])
    return float(np.divide(*contact.layout.comm.allreduce(sums)))


def solve(comm, name, size=8):
    """One of `CASES`, by an offset. Collective."""
    scene, u, sigma, F, bcs, turns = CASES[name](comm, size)
    contact = raymortar.Contact(
        u,
        scene.facet_tags,
        [(TAGS["slave"], TAGS["master"])],
        offset=-INTERFERENCE,
        axisymmetric=turns,
    )
    problem = raymortar.NonlinearProblem(F, contact, bcs)
    iterations, _ = raymortar.SNESSolver(problem).solve()
    return SimpleNamespace(
        scene=scene,
        u=u,
        sigma=sigma,
        contact=contact,
        turns=turns,
        iterations=iterations,
        history=list(problem.history),
        pressure=mean_pressure(contact),
    )


# Picture


def stresses_along_a_radius(result):
    """Radius, radial and hoop stress, means of cells; on the first rank. Collective."""
    x = ufl.SpatialCoordinate(result.scene.mesh)
    s, r = result.sigma, ufl.sqrt(x[0] ** 2 + x[1] ** 2)
    if result.turns:
        parts = x[0], s[0, 0], s[2, 2]
    else:
        radial = (x[0] ** 2 * s[0, 0] + x[1] ** 2 * s[1, 1]) / r**2
        radial += 2 * x[0] * x[1] * s[0, 1] / r**2
        parts = r, radial, s[0, 0] + s[1, 1] - radial
    return [cell_means(part, result.scene.mesh) for part in parts]


def cell_means(expression, mesh):
    """Means of an expression over all cells, on the first rank. Collective."""
    W = compat.space(mesh, "DG", 0)
    test, dx = ufl.TestFunction(W), ufl.dx(mesh, metadata={"quadrature_degree": 4})
    sums, sizes = (
        compat.create_la_vector(W.dofmap.index_map, 1).array for _ in range(2)
    )
    compat.assemble_residual(sums, compat.form(expression * test * dx))
    compat.assemble_residual(sizes, compat.form(test * dx))
    owned = W.dofmap.index_map.size_local
    return gather(mesh.comm, sums[:owned] / sizes[:owned])


def draw(results, curves, path):
    """Stresses over the radius, with Lame's."""
    plt = drawing.pyplot()
    figure, both = plt.subplots(1, 2, figsize=(9.5, 3.7), sharey=True)
    marks = {"plane stress": "o", "plane strain": "o"}
    for axes, strain in zip(both, (False, True)):
        p = exact_pressure(strain)
        for part in ((0.5, SHAFT - 1e-6), (SHAFT + 1e-6, HUB)):
            line = np.linspace(*part, 200)
            for values in exact_stresses(line, p):
                axes.plot(line, values, color=drawing.EXACT, lw=1)
        names = [n for n in results if ("strain" in n or "held" in n) == strain]
        for name in names:
            r, radial, hoop = curves[name]
            mark = marks.get(name, "x")
            axes.plot(r, radial, mark, ms=4, mfc="none", color=drawing.COMPUTED)
            axes.plot(
                r, hoop, mark, ms=4, mfc="none", color=drawing.COMPUTED, label=name
            )
        axes.set(xlabel="radius [mm]", xlim=(0, HUB))
        axes.legend(loc="upper left")
    both[0].set(ylabel="radial and hoop stress [MPa]")
    figure.tight_layout()
    figure.savefig(path)


def main(arguments=None):
    """Run the demo; 0 if it agrees with Lame's solution."""
    parser = common.options("press_fit_lame", __doc__)
    parser.add_argument("--size", type=int, default=8, help="facets on a quarter's arc")
    args = parser.parse_args(arguments)
    comm = MPI.COMM_WORLD
    report, results, curves = common.Report(comm), {}, {}
    args.output.mkdir(parents=True, exist_ok=True)
    for name in CASES:
        result = solve(comm, name, args.size * (2 if args.fine else 1))
        strain = "strain" in name or "held" in name
        report.effort(result.contact)
        report.newton(name, [result.iterations], result.history)
        report.add(name, result.pressure, exact_pressure(strain), 2e-3, "MPa")
        results[name], curves[name] = result, stresses_along_a_radius(result)
    last = results["axisymmetric, held ends"]
    io.write_xdmf(
        args.output / "press_fit_lame.xdmf",
        last.scene.mesh,
        [last.u, common.pressure_field(last.contact)],
    )
    if comm.rank == 0:
        draw(results, curves, args.output / "press_fit_lame.png")
    return report.finish()


if __name__ == "__main__":
    sys.exit(main())
