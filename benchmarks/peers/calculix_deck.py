"""A case as an input deck of CalculiX, which has the keywords of Abaqus."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from peer_case import Case

# Plane strain in 2D. CalculiX's user's manual recommends the quadratic elements with
# reduced integration; its C3D8 is of B-bar type
ELEMENTS = {
    ("quadrilateral", 1): "CPE4",
    ("quadrilateral", 2): "CPE8R",
    ("hexahedron", 1): "C3D8",
    ("hexahedron", 2): "C3D20R",
    ("tetrahedron", 1): "C3D4",
    ("tetrahedron", 2): "C3D10",
}
# Contact's TYPE by the form's name. The mortar types have hard contact; penalties have
# the stiffness that the manual recommends, 5 to 50 times Young's modulus
TYPES = {
    "surface": "SURFACE TO SURFACE",
    "node": "NODE TO SURFACE",
    "mortar": "MORTAR",
    "pglinmortar": "PGLINMORTAR",
}
STIFFNESS = 50.0
# Sticking springs are a tenth as stiff, as the manual proposes
STICK = 0.1
# Numbers on a line that lists some
WIDTH = 8


def listed(numbers: Iterable[int]) -> list[str]:
    """Numbers, some to a line."""
    shown = [str(number) for number in numbers]
    return [", ".join(shown[k : k + WIDTH]) for k in range(0, len(shown), WIDTH)]


def constants(case: Case, modulus: float) -> list[str]:
    """Lines of a body's law."""
    mu = modulus / (2.0 * (1.0 + case.nu))
    K = modulus / (3.0 * (1.0 - 2.0 * case.nu))
    if case.law == "linear":
        return ["*ELASTIC", f"{modulus:.12g}, {case.nu:.12g}"]
    return ["*HYPERELASTIC, NEO HOOKE", f"{mu / 2.0:.12g}, {2.0 / K:.12g}"]


def mesh(case: Case) -> list[str]:
    """Nodes, elements of each body, sets of nodes and surfaces, numbered from 1."""
    lines = ["*NODE, NSET=ALL"]
    used = np.unique(case.cells)
    for node in used:
        lines.append(
            f"{node + 1}, " + ", ".join(f"{x:.12g}" for x in case.places[node])
        )
    tags = case.scene.cell_tags
    kind = ELEMENTS[case.cell, case.degree]
    for body in case.moduli:
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET={body.upper()}")
        for cell in tags.find(case.scene.bodies[body]):
            first, *rest = listed([cell + 1, *(case.cells[cell] + 1)])
            # A line goes on in the next one after a comma
            lines.append(",\n".join([first, *rest]))
    for name in dict.fromkeys([*(name for name, _ in case.held), case.led]):
        lines.append(f"*NSET, NSET={name.upper()}")
        lines += listed(case.nodes(name) + 1)
    for name in (case.slave, case.master):
        lines.append(f"*SURFACE, NAME=S{name.upper()}, TYPE=ELEMENT")
        lines += [f"{cell + 1}, S{face + 1}" for cell, face in case.faces(name)]
    return lines


def contact(case: Case, form: str) -> list[str]:
    """The pair and its law."""
    stiffness = STIFFNESS * min(case.moduli.values())
    hard = "mortar" in form
    lines = ["*SURFACE INTERACTION, NAME=LAW"]
    if hard:
        lines.append("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD")
    else:
        lines.append("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR")
        lines.append(f"{stiffness:.12g}")
    if case.friction:
        lines.append("*FRICTION")
        lines.append(f"{case.friction:.12g}, {STICK * stiffness:.12g}")
    lines.append(f"*CONTACT PAIR, INTERACTION=LAW, TYPE={TYPES[form]}")
    lines.append(f"S{case.slave.upper()}, S{case.master.upper()}")
    return lines


def moved(case: Case) -> list[int]:
    """Components of the facets that are led."""
    return [i for i, value in enumerate(case.way(0.0)) if value is not None]


def amplitudes(case: Case) -> list[str]:
    """What the led facets do over the total time, by component."""
    times = [0.0, *case.times()]
    lines = []
    for i in moved(case):
        lines.append(f"*AMPLITUDE, NAME=A{i + 1}, TIME=TOTAL TIME")
        lines += [f"{t:.12g}, {case.way(t)[i]:.12g}" for t in times]
    return lines


def write(case: Case, form: str) -> str:
    """The whole deck: a *STEP for each leg, whose increments CalculiX may cut."""
    lines = ["*HEADING", "contact", *mesh(case)]
    for body, modulus in case.moduli.items():
        lines += [f"*MATERIAL, NAME=M{body.upper()}", *constants(case, modulus)]
        lines += [f"*SOLID SECTION, ELSET={body.upper()}, MATERIAL=M{body.upper()}"]
    lines += amplitudes(case) + contact(case, form)
    lines.append("*BOUNDARY")
    lines += [f"{name.upper()}, {i + 1}, {i + 1}" for name, i in case.held]
    begin = 0.0
    for end, steps in case.legs:
        length = end - begin
        increment = f"{length / steps:.12g}"
        lines.append(
            f"*STEP, INC={100 * steps}" + (", NLGEOM" if case.law != "linear" else "")
        )
        # Increments as long as the steps of the other programs, at most
        lines += ["*STATIC", f"{increment}, {length:.12g}, , {increment}"]
        for i in moved(case):
            lines.append(f"*BOUNDARY, AMPLITUDE=A{i + 1}")
            lines.append(f"{case.led.upper()}, {i + 1}, {i + 1}, 1.")
        lines.append(f"*NODE PRINT, NSET={case.led.upper()}, TOTALS=ONLY, FREQUENCY=1")
        lines.append("RF")
        # One frequency for all output, as CalculiX has no more
        lines += ["*CONTACT FILE, FREQUENCY=1", "CDIS, CSTR", "*END STEP"]
        begin = end
    return "\n".join(lines) + "\n"
