"""Tables of run times."""

from __future__ import annotations

import math

from .formats import (
    KINDS,
    Row,
    Table,
    brief,
    grouped,
    once,
    percent,
    shaped,
    spaced,
    table,
)

# Only ours has one by default
PREDICTS = ", with its predictor"


def _kind(row: Row, name: str = "shape") -> str:
    kind = KINDS[row[name]]
    return f"{kind}, {row['degree']}" if kind == "2D" else f"{kind} {row['degree']}"


def _cells(row: Row) -> str:
    """Name of a peer's cells, quadrilaterals being those of the plane."""
    flat = row["cell"] == "quadrilateral"
    name = "2D," if flat else KINDS[row["cell"]]
    return f"{name} {row['degree']}"


def _largest(rows: list[Row]) -> list[Row]:
    """Of each kind of cell and contact the largest problem."""
    kinds = grouped(rows, "cell", "degree", "contact")
    return [max(found, key=lambda row: int(row["unknowns"])) for _, found in kinds]


@table("speed/results/share.csv")
def share(rows: list[Row]) -> Table:
    """Microseconds of contact, volume and solver for each slave facet."""
    lines = [
        [
            "cells, degree",
            "contact",
            "unknowns",
            "pairing",
            "residual",
            "tangent",
            "volume",
            "MUMPS",
            "contact / volume",
        ]
    ]
    rows = _largest(rows)
    for name, row in zip(once(_cells(row) for row in rows), rows):
        each = 1e6 / float(row["facets"])
        volume = float(row["s_volume_residual"]) + float(row["s_volume_tangent"])
        stages = ("pairing", "residual", "tangent")
        own = [_micro(each * float(row[f"s_{stage}"])) for stage in stages]
        rest = [shaped(each * x, 3) for x in (volume, float(row["s_mumps"]))]
        lines.append(
            [
                name,
                row["contact"],
                f"{int(row['unknowns']):,}",
                *own,
                *rest,
                shaped(float(row["to_volume"]), 2),
            ]
        )
    return lines


@table("speed/results/share.csv")
def shares(rows: list[Row]) -> Table:
    """Contact's share of an iteration by the number of unknowns."""
    lines = [["cells, degree", "contact", "600 unknowns", "6,000", "40,000"]]
    kinds = list(grouped(rows, "cell", "degree", "contact"))
    names = once(_cells(found[0]) for _, found in kinds)
    for name, ((*_, contact), found) in zip(names, kinds):
        lines.append([name, contact, *(percent(row["share"]) for row in found)])
    return lines


@table("speed/results/peer.csv")
def peer(rows: list[Row]) -> Table:
    """Contact terms beside those of GetFEM, microseconds for each slave facet."""
    lines = [
        [
            "facets, degree",
            "points a facet",
            "pairing",
            "residual",
            "tangent",
            "full",
            "GetFEM: points",
            "residual",
            "tangent",
            "residual, times faster",
            "tangent",
            "full",
            "tangent, per point",
        ]
    ]
    for row in rows:
        ours = ("us_pairing", "us_residual", "us_tangent", "us_full_tangent")
        times = ("x_residual", "x_tangent", "x_full_tangent")
        lines.append(
            [
                _cells(row),
                f"{float(row['points']):.2g}"
                if float(row["points"]) >= 10
                else f"{float(row['points']):.1f}",
                *(
                    shaped(float(row[name]), 3 if float(row[name]) >= 100 else 2)
                    for name in ours
                ),
                row["getfem_points"],
                *(
                    shaped(float(row[name]), 3 if float(row[name]) >= 100 else 2)
                    for name in ("getfem_us_residual", "getfem_us_tangent")
                ),
                *(shaped(float(row[name]), 2) for name in times),
                f"{float(row['x_tangent_point']):.0f}",
            ]
        )
    return lines


@table("speed/results/ironing.csv")
def path(rows: list[Row]) -> Table:
    """A whole path beside GetFEM's."""
    heads = ["", "program", "steps", "iterations a step", "CPU seconds", "elapsed"]
    lines = [[*heads, "times faster", "vertical, horizontal reaction"]]
    for (setting,), found in grouped(rows, "setting"):
        own = found[0] if setting == "as used" else None
        for row in found:
            seconds, steps = float(row["seconds"]), int(row["steps"])
            ratio = float(found[-1]["seconds"]) / seconds
            lines.append(
                [
                    setting if row is found[0] else "",
                    row["program"] + (PREDICTS if row is own else ""),
                    row["steps"],
                    f"{int(row['iterations']) / steps:.1f}",
                    f"{seconds:.1f}",
                    f"{float(row['wall']):.1f}",
                    "" if row is found[-1] else f"{ratio:.1f}",
                    f"{float(row['V']):.1f}, {float(row['H']):.1f}",
                ]
            )
    return lines


@table("speed/results/ironing.csv")
def path_shares(rows: list[Row]) -> Table:
    """Where the seconds of our path go."""
    names = ("solver", "forms", "contact", "python")
    lines = [["raymortar", "linear solver", "forms", "contact", "Python and the rest"]]
    for row in rows:
        if row["program"] == "raymortar":
            own = [percent(row[f"{name}_share"]) for name in names]
            lines.append([row["setting"], *own])
    return lines


@table("speed/results/pairing.csv", "speed/results/pairing_growth.csv")
def search(rows: list[Row], growth: list[Row]) -> Table:
    """Seconds of the search by the number of slave facets."""
    sizes = ("1,000", "10,000", "100,000", "1,000,000")
    lines = [["seconds", *sizes, "exponent", "from 10,000 on"]]
    slopes = {(row["shape"], row["strategy"]): row["candidates"] for row in growth}
    for (shape, strategy), found in grouped(rows, "shape", "strategy"):
        seconds = [brief(row["s_candidates"]) for row in found]
        slope = f"{float(slopes[shape, strategy]):.2f}"
        times = [float(row["s_candidates"]) for row in found[1::2]]
        later = f"{math.log(times[1] / times[0]) / math.log(100):.2f}"
        lines.append([f"{KINDS[shape]}, `{strategy}`", *seconds, slope, later])
    return lines


@table("speed/results/stages_growth.csv")
def growth(rows: list[Row]) -> Table:
    """Exponents of the stages over the number of slave facets."""
    names = "candidates segments rays residual blocks tangent floor".split()
    lines = [["exponents", *names]]
    for row in rows:
        lines.append([_kind(row), *(f"{float(row[name]):.2f}" for name in names)])
    return lines


@table("speed/results/stages.csv")
def memory(rows: list[Row]) -> Table:
    """Kilobytes for each slave facet."""
    lines = [["facets, degree", "1,000", "10,000", "100,000"]]
    rows = [row for row in rows if row["contact"] != "friction"]
    for _, found in grouped(rows, "shape", "degree"):
        large = [row for row in found if int(row["facets"]) > 500]
        sizes = [f"{float(r['bytes']) / 1000 / int(r['facets']):.1f}" for r in large]
        lines.append([_kind(large[0]), *sizes, *[""] * (3 - len(sizes))])
    return lines


@table("speed/results/stages.csv")
def stages(rows: list[Row]) -> Table:
    """Microseconds of each stage for each slave facet, at 10,000 facets."""
    names = (
        "candidates segments rays first again unmoved residual blocks insertion"
        " tangent floor"
    ).split()
    lines = [["facets, degree", "pairs", "points", *names, "tangent / floor"]]
    for row in rows:
        if 9_000 < int(row["facets"]) < 11_000:
            facets = int(row["facets"])
            each = [1e6 * float(row[f"s_{name}"]) / facets for name in names]
            ratio = float(row["s_tangent"]) / float(row["s_floor"])
            points = float(row["points"]) / facets
            rubs = row["contact"] == "friction"
            lines.append(
                [
                    "the same, friction" if rubs else _kind(row),
                    f"{int(row['pairs']) / facets:.1f}",
                    f"{points:.1f}" if points < 10 else f"{points:.0f}",
                    *(_micro(value, name) for name, value in zip(names, each)),
                    f"{ratio:.2f}",
                ]
            )
    return lines


def _micro(value: float, name: str = "") -> str:
    """Microseconds to two digits, those of no movement to one."""
    if name == "unmoved":
        return brief(value, 1)
    return brief(value, 3 if value >= 100 else 2)


@table("rigid/cost.csv")
def rigid_cost(rows: list[Row]) -> Table:
    """Cost of rigid tools over that of a meshed one that is held."""
    names = {
        "quadrilateral": "of quadrilaterals",
        "tetrahedron": "of tetrahedra",
        "hexahedron": "of hexahedra",
    }
    lines = [["slave facets", "pairing: `Surface`, `Plane`", "residual", "tangent"]]
    for (cell, degree), (meshed, *tools) in grouped(rows, "cell", "degree"):
        name = f"{names[cell]}, degree 1" if degree == "1" else f"degree {degree}"
        ratios = [
            ", ".join(
                _ratio(float(tool[stage]) / float(meshed[stage])) for tool in tools
            )
            for stage in ("pairing", "residual", "tangent")
        ]
        lines.append([name, *ratios])
    return lines


def _ratio(value: float) -> str:
    """A tenth, below that a hundredth."""
    return f"{value:.1f}" if value >= 0.095 else f"{value:.2f}"


@table("speed/results/self_contact.csv")
def self_contact(rows: list[Row]) -> Table:
    """Surfaces that meet themselves: times over those of named pairs."""
    stages = "candidates", "segments", "rays", "residual", "tangent"
    lines = [["layers", "pairs", "facets", *stages, "search", "pairing", "assembly"]]
    for (dim, _, cells), (named, *others) in grouped(rows, "dim", "between", "cells"):
        for row in (named, *others):
            mine, base = (
                [float(one[f"us_{stage}"]) for stage in stages] for one in (row, named)
            )
            parts = slice(0, 1), slice(0, 3), slice(3, 5)
            ratios = [sum(mine[p]) / sum(base[p]) for p in parts]
            thick = f"{dim}D, {cells} cell{'s' if cells != '1' else ''} thick"
            lines.append(
                [
                    thick if row is named else "",
                    row["pairs"],
                    spaced(row["facets"]),
                    *map(_micro, mine),
                    *("1" if row is named else _ratio(r) for r in ratios),
                ]
            )
    return lines
