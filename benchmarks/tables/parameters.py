"""Tables of what the parameters of contact do."""

from __future__ import annotations

from collections.abc import Iterable
from math import fsum

from .formats import Row, Table, brief, grouped, halved, percent, table

METHODS = {
    "augmented": "augmented Lagrangian",
    "elastic": 'penalty, `"elastic"`',
    "rate": 'penalty, `"rate"`',
}


def _lost(value: str, method: str) -> str:
    change = float(value)
    if method == "rate":
        return f"{100 * change:.1f} %"
    if change == 0.0:
        return "none"
    return "below 1e-13" if change < 2e-13 else f"{change:.0e}"


@table("parameters/holding.csv")
def holding(rows: list[Row]) -> Table:
    """Shear force that is lost while nothing moves."""
    lines = [
        [
            "",
            "uniform state, flat surfaces",
            "clamped blocks, 2, 4, 8, 16 facets: first step",
            "last step",
            "20 steps in all",
        ]
    ]
    for (method,), found in grouped(rows, "method"):
        uniform, *clamped = found
        lines.append(
            [METHODS[method], _lost(uniform["last_step"], method)]
            + [
                _together(_lost(row[name], method) for row in clamped)
                for name in ("first_step", "last_step", "in_all")
            ]
        )
    return lines


def _together(cells: Iterable[str]) -> str:
    """Cells in one; "none" for all stands once."""
    found = list(cells)
    return "none" if set(found) == {"none"} else ", ".join(found)


@table("parameters/automatic.csv")
def automatic(rows: list[Row]) -> Table:
    """Iterations over multiples of the automatic coefficient."""
    quantities = {
        "peak pressure": ("peak pressure", percent),
        "tangential traction": ("tangential traction in L2", percent),
        "V": ("vertical reaction at the end", lambda value: f"{float(value):.1f}"),
    }
    head = ["augmented Lagrangian", "x 0.01", "x 0.1", "x 0.3", "**x 1**", "x 10"]
    lines = [head]
    for (scene,), found in grouped(rows, "scene"):
        name, _, quantity = scene.partition("; ")
        cells = [[halved(row["iterations"], row["halved"]) for row in found]]
        names = [name]
        if quantity:
            says, shown = quantities[quantity]
            names.append(f"the same, {says}")
            cells.append(
                [
                    "" if row["figure"] == "nan" else shown(row["figure"])
                    for row in found
                ]
            )
        for name, line in zip(names, cells):
            line[3] = f"**{line[3]}**"
            lines.append([name, *line])
    return lines


@table("parameters/automatic_penalty.csv")
def automatic_penalty(rows: list[Row]) -> Table:
    """Error of the force over multiples of the automatic coefficient."""
    head = "penalty: error of the force (iterations, cuts)"
    lines = [[head, "x 1", "x 3", "**x 10**", "x 30"]]
    for (scene,), found in grouped(rows, "scene"):
        cells = []
        for row in found:
            count = row["iterations"] + (
                f", {row['halved']}" if row["halved"] != "0" else ""
            )
            cells.append(f"{percent(row['force'], signed=True)} ({count})")
        cells[2] = f"**{cells[2]}**"
        lines.append([scene, *cells])
    return lines


def _over_gamma(rows: list[Row]) -> Table:
    lines = [
        [
            "factor",
            "augmented: iterations",
            "force",
            "penalty: iterations",
            "force",
            "largest penetration",
        ]
    ]
    for row in rows:
        error = float(row["augmented_force"])
        cells = [
            row["factor"],
            row["augmented_iterations"],
            percent(error, signed=True) if abs(error) > 1e-15 else "0",
            row["penalty_iterations"],
        ]
        if row["penalty_force"] == "nan":
            cells += ["", ""]
        elif float(row["penalty_force"]) == -1.0:
            cells += ["no contact within `depth`", ""]
        else:
            cells += [
                percent(row["penalty_force"], signed=True),
                brief(row["penalty_penetration"]),
            ]
        lines.append(cells)
    return lines


@table("parameters/gamma_blocks.csv")
def gamma_blocks(rows: list[Row]) -> Table:
    """A block on a block over `gamma`."""
    return _over_gamma(rows)


@table("parameters/gamma_cylinder.csv")
def gamma_cylinder(rows: list[Row]) -> Table:
    """A cylinder on a block over `gamma`."""
    return _over_gamma(rows)


def _gamma(row: Row) -> str:
    is_automatic = row["gamma"] == "automatic"
    return f"{float(row['value']):.0f}" + (" (automatic)" if is_automatic else "")


@table("parameters/gamma_friction.csv")
def gamma_friction(rows: list[Row]) -> Table:
    """Ironing over `gamma` and the slip of a step, coarse mesh."""
    bound = 106.0
    lines = [
        [
            "60 x 15 elements, `gamma` [MPa/mm]",
            "slip of a step [mm]",
            "product over bound",
            "V [N/mm]",
            "H [N/mm]",
            "iterations of a step (cuts)",
        ]
    ]
    for row in rows:
        if row["size"] != "60":
            continue
        product = float(row["value"]) * float(row["slip"]) / bound
        steps = halved(f"{float(row['iterations']):.1f}", row["halved"])
        forces = [f"{float(row[name]):.1f}" for name in ("V", "H")]
        lines.append([_gamma(row), row["slip"], f"{product:.2g}", *forces, steps])
    return lines


@table("parameters/gamma_friction.csv")
def gamma_friction_fine(rows: list[Row]) -> Table:
    """Ironing over `gamma`, fine mesh."""
    fine = [row for row in rows if row["size"] == "120"]
    names = {"V": "V", "H": "H", "iterations": "iterations of each step"}
    lines = [["`gamma`", *map(_gamma, fine)]]
    for name, says in names.items():
        lines.append([says, *(f"{float(row[name]):.1f}" for row in fine)])
    return lines


@table("parameters/quadrature.csv")
def quadrature(rows: list[Row]) -> Table:
    """The force over the degree of the rule."""
    names = ["degree", "points", "iterations", "force"]
    head = ["degree", "integration points", "iterations", "force"]
    return [head, *([row[name] for name in names] for row in rows)]


@table("tangent.csv")
def tangents(rows: list[Row]) -> Table:
    """Iterations with the tangent at fixed points and through moving segments."""
    groups = {
        "blocks: slave inside": "blocks, the slave inside the master's surface",
        "blocks: slave inside, friction": "the same, dragged",
        "blocks: equal widths": "as wide as the master",
        "blocks: slave overhangs": "wider",
        "blocks: over the edge, friction": "as wide, dragged over the edge",
        "blocks: curved": "curved, geometry of degree 2",
        "Hertz": "Hertz: cylinders (degree 1, 2, both methods), spheres, Cattaneo and"
        " Mindlin",
        "demos": "demos: punch, equal blocks, half ring (2), press fit, ironing (3)",
        "": "all",
    }
    head = ["", "scenes", "fail: fixed, full", "halved", "iterations", "seconds"]
    lines = [head]
    for group, name in groups.items():
        own = [row for row in rows if not group or row["group"] == group]
        pairs = list(zip(own[::2], own[1::2]))
        both = [pair for pair in pairs if all(row["steps"].isdigit() for row in pair)]
        fails = [sum(not pair[k]["steps"].isdigit() for pair in pairs) for k in (0, 1)]
        cells = [str(len(pairs)), "{}, {}".format(*fails)]
        # The plain sum rounds in another way from Python 3.12 on
        for column, form in (
            ("halved", ".0f"),
            ("iterations", ".0f"),
            ("seconds", ".1f"),
        ):
            sums = [fsum(float(pair[k][column]) for pair in both) for k in (0, 1)]
            cells.append(", ".join(format(value, form) for value in sums))
        lines.append([name, *cells])
    return lines


@table("parameters/cycles.csv")
def cycles(rows: list[Row]) -> Table:
    """Work of friction of two loops of shear, over the steps of a loop."""
    lines = [["", *dict.fromkeys(row["steps"] for row in rows)]]
    for (method, facets), found in grouped(rows, "method", "facets"):
        for column, says in (("first_loop", "first loop"), ("second_loop", "second")):
            values = [f"{float(row[column]):.2e}" for row in found]
            lines.append([f"{METHODS[method]}, {facets} facets: {says}", *values])
    return lines
