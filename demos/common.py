"""What the demos share: options, tables, fields and values at nodes.

Nothing here is needed to solve a contact problem: the demos' own files show that.
"""

from __future__ import annotations

import argparse
import logging
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from dolfinx import fem

from raymortar.plotting.gathering import gather

__all__ = [
    "Report",
    "follow",
    "gather_nodes",
    "options",
    "place_of",
    "pressure_field",
    "value_at_origin",
]

# The compiler of forms is chatty the first time
logging.disable(logging.INFO)


def options(name: str, description: str) -> argparse.ArgumentParser:
    """Options that every demo has."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    parser.add_argument(
        "--output",
        type=Path,
        default=Path("results") / name,
        help="folder for the picture and the ParaView file",
    )
    parser.add_argument("--fine", action="store_true", help="a finer mesh")
    return parser


# Motion


def follow(steps, u, frames):
    """Run time steps; return u at some times, as (time, array), and the iterations."""
    begin, end = steps.path
    kept, iterations = [(begin, u.x.array.copy())], []
    for step in steps:
        iterations.append(step.iterations)
        if step.time >= begin + len(kept) * (end - begin) / frames - 1e-9:
            kept.append((step.time, u.x.array.copy()))
    return kept, iterations


# Tables


@dataclass
class Report:
    """Table of our figures against closed forms, printed on rank 0.

    Rows with a tolerance decide whether the demo passes.
    """

    comm: object
    rows: list[tuple] = field(default_factory=list)

    def add(self, name, ours, exact, tolerance=None, unit=""):
        """A row; `tolerance` is relative to `exact`."""
        self.rows.append((name, float(ours), float(exact), tolerance, unit))

    def say(self, text=""):
        """Print on rank 0."""
        if self.comm.rank == 0:
            print(text, flush=True)

    def effort(self, contact, iterations=None, halvings=None):
        """Unknowns and, over a whole path, Newton iterations and halved steps."""
        text = f"{contact.layout.size_global} unknowns"
        if iterations is not None:
            text += f", {int(np.sum(iterations))} Newton iterations"
        if halvings is not None:
            text += f", {halvings} halvings"
        self.say(text)

    def newton(self, title, iterations, history):
        """Iterations of the steps, and the residuals of the last one."""
        self.say(f"{title}: {', '.join(map(str, iterations))} Newton iterations")
        self.say("  residual " + " ".join(f"{r:.1e}" for r in history))

    def finish(self, against="closed form") -> int:
        """Print the table; 0 if all rows are within their tolerance, else 1."""
        self.say(f"\n{'':34}{'ours':>12}{against:>13}{'deviation':>11}  allowed")
        passed = True
        for name, ours, exact, tolerance, unit in self.rows:
            deviation = (ours - exact) / abs(exact)
            allowed = "" if tolerance is None else f"{_percent(tolerance)}"
            if tolerance is not None and not abs(deviation) <= tolerance:
                passed, allowed = False, allowed + "  FAILED"
            label = f"{name} [{unit}]" if unit else name
            self.say(
                f"{label:34}{ours:12.6g}{exact:13.6g}{_percent(deviation, '+'):>11}  "
                + allowed
            )
        self.say("passed" if passed else "FAILED")
        return 0 if passed else 1


def _percent(x: float, sign: str = "") -> str:
    """A ratio in percent, tiny ones by their power of ten."""
    return f"{x:{sign}.2%}" if abs(x) >= 5e-5 or x == 0.0 else f"{x:{sign}.0e}"


# Fields


def pressure_field(contact):
    """Contact pressure (positive in compression) for ParaView."""
    p = fem.Function(contact.multiplier.function_space, name="pressure")
    p.x.array[:] = -contact.multiplier.x.array
    return p


def value_at_origin(function, scene, name: str, component: int = 0) -> float:
    """Value at the node of a named surface that is at the origin. Collective."""
    V = function.function_space
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, scene.mesh.topology.dim - 1, facets)
    distance = np.linalg.norm(V.tabulate_dof_coordinates()[dofs], axis=1)
    values = function.x.array.reshape(-1, V.dofmap.index_map_bs)[:, component]
    nearest = distance.argmin() if len(dofs) else None
    here = (
        (np.inf, 0.0) if nearest is None else (distance[nearest], values[dofs][nearest])
    )
    return min(scene.mesh.comm.allgather(here))[1]


def place_of(u, scene, name: str, x: float):
    """Deformed place of the node of a named surface that is nearest to x. Collective."""
    at, moved = scene.mesh.comm.bcast(gather_nodes(u, scene, name))
    nearest = np.abs(at[:, 0] - x).argmin()
    return at[nearest, : moved.shape[1]] + moved[nearest]


# Gathering on rank 0


def gather_nodes(function, scene, name: str = "slave"):
    """Nodes of a named surface, (n, 3), and values there, (n, components)."""
    V = function.function_space
    comm, dim = scene.mesh.comm, scene.mesh.topology.dim
    facets = scene.facet_tags.find(scene.tags[name])
    dofs = fem.locate_dofs_topological(V, dim - 1, facets)
    dofs = dofs[dofs < V.dofmap.index_map.size_local]
    values = function.x.array.reshape(-1, V.dofmap.index_map_bs)[dofs]
    return gather(comm, V.tabulate_dof_coordinates()[dofs]), gather(comm, values)
