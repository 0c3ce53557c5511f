"""What is run: problems with a known answer, over sizes and settings."""

from __future__ import annotations

import dataclasses
import statistics

from clock import Clock
from manufactured import REST, Manufactured
from manufactured_fields import CUBE, SQUARE, TWO_CUBES, TWO_SQUARES, Motion
from manufactured_scenes import SLIDE
from problems import COMM

import raymortar

# Solves shorter than this are repeated, and the median is taken
SHORT, REPEATS = 2.0, 3
SMALLEST = {"D2": 6, "D3": 4}
FIELDS = {"B1": CUBE, "B2": SQUARE, "B4": TWO_SQUARES, "B4 3D": TWO_CUBES}


@dataclasses.dataclass(frozen=True)
class Run:
    """One solve. `method` is "augmented", or "penalty" with a coefficient in units of
    modulus over cell size, such as "penalty 100"."""

    problem: str
    cell: str
    degree: int
    n: int
    quadrature: int | None = None
    method: str = "augmented"
    multiplier: str = "normal"
    measure: str = "reference"
    tangent: str | None = None
    shake: float = 0.0
    swap: bool = False
    curved: bool = True

    @property
    def row(self):
        """Settings as they are written to the results."""
        return {
            "problem": self.problem + (", swapped" if self.swap else ""),
            "program": "raymortar",
            "cell": self.cell,
            "degree": self.degree,
            "n": self.n,
            "mesh": ("shaken" if self.shake else "regular")
            + ("" if self.curved else ", flat master"),
            "quadrature": "default" if self.quadrature is None else self.quadrature,
            "method": self.method,
            "multiplier": "" if "penalty" in self.method else self.multiplier,
            "measure": self.measure,
            "tangent": "default" if self.tangent is None else self.tangent,
        }


def manufactured(run: Run) -> Manufactured:
    """The problem of a run, not yet solved."""
    fields = FIELDS[run.problem]
    motion = REST
    if fields.lower is not None:
        motion = Motion((0.0, 0.0), SLIDE[fields.dim])
    options = {} if run.tangent is None else {"tangent": run.tangent}
    method = raymortar.AugmentedLagrangian(multiplier=run.multiplier)
    if run.method != "augmented":
        # Modulus 1 over the size of a cell, about the automatic coefficient
        method = raymortar.Penalty(float(run.method.split()[1]) * run.n)
    problem = Manufactured(
        fields,
        run.cell,
        run.n,
        run.degree,
        motion,
        method,
        swap=run.swap,
        shake=run.shake,
        curved=run.curved,
        quadrature_degree=run.quadrature,
        measure=run.measure,
        **options,
    )
    return problem


def timed(solve):
    """Repeat `solve`, which sets up and solves; its result and median seconds."""
    samples = []
    while not samples or (
        len(samples) < REPEATS and samples[-1]["seconds"] < SHORT / REPEATS
    ):
        result, clock = solve()
        samples.append(clock.seconds)
    median = statistics.median_low([s["seconds"] for s in samples])
    return result, next(s for s in samples if s["seconds"] == median)


def measure(run: Run) -> dict:
    """Solve a manufactured problem: settings, errors, seconds."""

    def once():
        problem = manufactured(run)
        with Clock() as clock:
            iterations = problem.solve()
        return (problem, iterations), clock

    (problem, iterations), seconds = timed(once)
    errors = problem.errors()
    row = run.row | {
        "unknowns": problem.contact.layout.size_global,
        "iterations": iterations,
        "error_u": max(errors["u_upper"], errors.get("u_lower", 0.0)),
        "error_H": max(errors["H_upper"], errors.get("H_lower", 0.0)),
        "error_pressure": errors["pressure"],
    }
    if "multiplier" in errors:
        row["error_multiplier"] = errors["multiplier"]
    return row | seconds


def demo(run: Run) -> dict:
    """Solve the demo of D2 or D3, with the errors that it reports."""
    from models import cattaneo_mindlin, hertz_sphere

    module = {"D2": cattaneo_mindlin, "D3": hertz_sphere}[run.problem]

    def once():
        with Clock() as clock:
            result = module.solve(
                COMM,
                run.n,
                run.degree,
                cell=run.cell,
                quadrature_degree=run.quadrature,
                measure=run.measure,
                **options,
            )
        return result, clock

    options = {} if run.tangent is None else {"tangent": run.tangent}
    # Compiles the forms
    module.solve(COMM, SMALLEST[run.problem], run.degree, cell=run.cell)
    result, clock = once()
    found = module.measure(result)
    row = run.row | {
        "unknowns": result.contact.layout.size_global,
        "iterations": sum(result.iterations),
    }
    if run.problem == "D2":
        row["multiplier"] = "vector"
        row["error_multiplier"] = float(found.normal_off)
        row["error_tangential"] = float(found.tangential_off)
    else:
        row["error_multiplier"] = float(abs(found.axis / found.p0 - 1.0))
    return row | clock.seconds


def getfem(run: Run) -> dict:
    """The same problem in GetFEM; `quadrature` is that of its slave facets."""
    from getfem_peer import Peer

    def once():
        problem = manufactured(run)
        peer = Peer(problem, run.degree, run.quadrature)
        iterations, seconds = peer.solve()
        peer.set_volume()
        return (problem, iterations), Seconds(seconds)

    (problem, iterations), seconds = timed(once)
    errors = problem.errors(points=False)
    return (
        run.row
        | {
            "program": "GetFEM",
            "tangent": "",
            "unknowns": problem.contact.layout.size_global,
            "iterations": iterations,
            "error_u": errors["u_upper"],
            "error_H": errors["H_upper"],
            "error_multiplier": errors["multiplier"],
        }
        | seconds
    )


@dataclasses.dataclass
class Seconds:
    """What `timed` reads of a clock."""

    seconds: dict
