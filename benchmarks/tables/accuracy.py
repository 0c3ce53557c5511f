"""Tables of errors."""

from __future__ import annotations

from itertools import product
from math import log2

from fronts import of, seconds_at

from .formats import Row, Table, grouped, percent, shaped, table

CELLS = {"hexahedron": "hexahedra", "tetrahedron": "tetrahedra"}
RATIOS = {"1": "1", "1000": "1000", "0.001": "1/1000"}


def _power(value: str, digits: int = 1) -> str:
    """A number with an exponent of one digit."""
    mantissa, exponent = f"{float(value):.{digits}e}".split("e")
    return f"{mantissa}e{int(exponent)}"


@table("parameters/flux.csv")
def flux(rows: list[Row]) -> Table:
    """The multiplier beside the flux without contact."""
    lines = [["cells", "n", "multiplier in contact", "flux without contact"]]
    for row in rows:
        shaken = ", shaken" if row["shake"] != "0" else ""
        name = f"{row['cell']} {row['degree']}{shaken}"
        errors = [_power(row[column]) for column in ("multiplier", "flux")]
        lines.append([name, row["n"], *errors])
    return lines


def _variation(value: float) -> str:
    return f"{value:.3f}"


@table("parameters/oscillation.csv")
def oscillation(rows: list[Row]) -> Table:
    """Total variation of the multiplier over that of the pressure."""
    heads = [f"{row['cell']} {row['degree']}" for row in rows[:4]]
    lines = [["slave : master facets, E of master / slave", *heads]]
    for (slave, master, ratio), found in grouped(rows, "slave", "master", "ratio"):
        name = f"{slave} : {master}, {RATIOS[ratio]}"
        if not (ratio == "0.001" and int(slave) > int(master)):
            values = [_variation(float(row["variation"])) for row in found]
            lines.append([name, *values])
        elif slave == "64":
            # The wave itself is lost in rounding: `roughness` has these
            lines.append([name, "(below)", "", "", ""])
    return lines


@table("parameters/oscillation.csv")
def roughness(rows: list[Row]) -> Table:
    """Roughness of the multiplier on a coarse stiff master."""
    stiff = [
        r for r in rows if r["ratio"] == "0.001" and int(r["slave"]) > int(r["master"])
    ]
    lines = [["master facets", *dict.fromkeys(row["master"] for row in stiff)]]
    for row in stiff[:4]:
        kind = (row["cell"], row["degree"])
        own = [r for r in stiff if (r["cell"], r["degree"]) == kind]
        values = [f"{float(r['roughness']):.2g}" for r in own]
        lines.append([" ".join(kind), *values])
    return lines


@table("accuracy/results/breaks.csv")
def chords(rows: list[Row]) -> Table:
    """What chords for bent edges change."""
    lines = [
        [
            "problem, n",
            "error of u",
            "all defaults",
            "subdivided",
            "degree 12: chords alone",
            "error of the multiplier",
            "all defaults",
            "subdivided",
            "degree 12",
        ]
    ]
    for (problem, cell), found in grouped(rows, "problem", "cell"):
        first = f"{problem}, {CELLS[cell]}, "
        for (n,), (default, divided, fine, _) in grouped(found, "n"):
            cells = [f"{first}{n}"]
            for name in ("u", "multiplier"):
                cells.append(f"{float(default[f'error_{name}']):.1e}")
                for row in (default, divided, fine):
                    cells.append(f"{float(row[f'difference_{name}']):.1e}")
            lines.append(cells)
            first = ""
    return lines


def _numbers(rows: list[Row]) -> list[dict]:
    """Rows of `accuracy.csv` with numbers for sizes, errors and seconds."""
    numbers = ("degree", "n", "error_u", "error_H", "error_multiplier", "seconds")
    return [
        row | {name: float(row[name]) for name in numbers if row[name]} for row in rows
    ]


def _kind(row: dict) -> str:
    return f"{row['cell']} {row['degree']:g}"


@table("accuracy/results/accuracy.csv")
def rates(rows: list[Row]) -> Table:
    """Mean orders from the first mesh to the last, and the errors of the last."""
    names = ("error_u", "error_H", "error_multiplier")
    settings = {"measure": "reference", "multiplier": "normal", "tangent": "default"}
    settings |= {"program": "raymortar", "quadrature": "default", "method": "augmented"}
    shown = of(_numbers(rows), **settings)
    keys = ("problem", "cell", "degree", "mesh")
    heads = ["problem", "cell, degree", "mesh", "n", "u", "grad u", "multiplier"]
    lines = [[*heads, "errors"]]
    for key in sorted({tuple(row[k] for k in keys) for row in shown}):
        part = sorted(of(shown, **dict(zip(keys, key))), key=lambda row: row["n"])
        if key[0].startswith("D") or len(part) < 2:
            continue
        first, last = part[0], part[-1]
        halvings = log2(last["n"] / first["n"])
        orders = [log2(first[name] / last[name]) / halvings for name in names]
        lines.append(
            [key[0], _kind(last), key[3], f"{first['n']:g} to {last['n']:g}"]
            + [f"{order:.2f}" for order in orders]
            + [", ".join(f"{last[name]:.1e}" for name in names)]
        )
    return lines


@table("accuracy/results/accuracy.csv")
def faceted(rows: list[Row]) -> Table:
    """Errors of degree 1 on an exact rigid master, and on one of flat facets."""
    settings = {"program": "raymortar", "quadrature": "default", "degree": 1.0}
    settings |= {"method": "augmented", "measure": "reference", "tangent": "default"}
    found = of(_numbers(rows), **settings)
    heads = ["problem", "cell", "n", "u: exact", "faceted", "multiplier: exact"]
    lines = [[*heads, "faceted"]]
    for row in of(found, mesh="regular, flat master"):
        same = {key: row[key] for key in ("problem", "cell", "n")}
        for exact in of(found, mesh="regular", multiplier="normal", **same):
            pair = (exact, row)
            lines.append(
                [row["problem"], row["cell"], f"{row['n']:g}"]
                + [f"{each['error_u']:.1e}" for each in pair]
                + [percent(each["error_multiplier"]) for each in pair]
            )
    return lines


@table("accuracy/results/accuracy.csv")
def peer_times(rows: list[Row]) -> Table:
    """Seconds in which GetFEM and raymortar reach an error."""
    shown = [row for row in _numbers(rows) if "flat" in row["mesh"]]
    kinds = sorted({(row["problem"], row["cell"], row["degree"]) for row in shown})
    lines = [["problem", "cell, degree", "program", "1 %", "0.1 %", "0.01 %"]]
    for kind, program in product(kinds, ("raymortar", "GetFEM")):
        names = ("problem", "cell", "degree", "program")
        part = of(shown, **dict(zip(names, (*kind, program))))
        times = [seconds_at(part, "error_u", level) for level in (1e-2, 1e-3, 1e-4)]
        cells = ["-" if time is None else f"{time:.3g}" for time in times]
        lines.append([kind[0], f"{kind[1]} {kind[2]:g}", program, *cells])
    return lines


@table("accuracy/results/accuracy.csv")
def closed_forms(rows: list[Row]) -> Table:
    """Errors of tractions with kinks: Cattaneo and Mindlin, and two spheres."""
    names = {"D2": "D2, Cattaneo and Mindlin", "D3": "D3, two spheres (peak)"}
    settings = {"tangent": "default", "quadrature": "default", "mesh": "regular"}
    shown = [row for row in of(rows, **settings) if row["problem"] in names]
    heads = ["problem", "cells", "facets across", "error of the normal traction"]
    lines = [[*heads, "of the tangential one", "seconds"]]
    for (problem, cell, degree), found in grouped(shown, "problem", "cell", "degree"):
        errors = [
            ", ".join(percent(row[name]) for row in found if row[name])
            for name in ("error_multiplier", "error_tangential")
        ]
        seconds = ", ".join(f"{float(row['seconds']):.2g}" for row in found)
        sizes = ", ".join(row["n"] for row in found)
        lines.append([names[problem], f"{cell} {degree}", sizes, *errors, seconds])
    return lines


@table("accuracy/results/accuracy.csv")
def penalties(rows: list[Row]) -> Table:
    """Errors with penalties beside those with the augmented Lagrangian."""
    methods = ("augmented", "penalty 10", "penalty 100", "penalty 1000")
    heads = [method.removeprefix("penalty ") for method in methods]
    lines = [["", *heads]]
    kind = {"problem": "B2", "program": "raymortar", "cell": "quadrilateral", "n": "16"}
    kind |= {"mesh": "regular", "quadrature": "default", "measure": "reference"}
    for degree in ("2", "1"):
        found = [
            next(
                row
                for row in of(rows, degree=degree, method=method, **kind)
                if row["multiplier"] != "vector"
            )
            for method in methods
        ]
        name = f"degree {degree}: "
        lines += [
            [f"{name}error of u", *(_power(row["error_u"]) for row in found)],
            [
                f"{name}error of the pressure at points",
                *(percent(row["error_pressure"]) for row in found),
            ],
            [f"{name}iterations", *(row["iterations"] for row in found)],
        ]
    return lines


@table("accuracy/results/accuracy.csv")
def quadrature_in_3d(rows: list[Row]) -> Table:
    """Errors over the degree of the rule on segments, B1 on shaken meshes."""
    degrees = ("1", "2", "3", "4", "5", "6", "12")
    lines = [["", f"degree: {degrees[0]}", *degrees[1:]]]
    kind = {"problem": "B1", "program": "raymortar", "mesh": "shaken"}
    for cell, degree in product(("tetrahedron", "hexahedron"), ("1", "2")):
        found = [
            of(rows, quadrature=rule, cell=cell, degree=degree, **kind)[-1]
            for rule in degrees
        ]
        for column, says in (("error_multiplier", "multiplier"), ("error_u", "u")):
            values = [_power(row[column], 2) for row in found]
            lines.append([f"{cell} {degree}, {says}", *values])
    return lines


SCENES = {
    "hertz_2d": "cylinder on block",
    "hertz_3d": "ball on block",
    "punch": "flat punch",
    "partial_slip": "partial slip",
    "wedge": "wedge",
    "ironing": "ironing",
    "ball": "rigid ball, section",
    "ball_3d": "rigid ball, a quarter",
}


@table("accuracy/results/edges.csv")
def edges(rows: list[Row]) -> Table:
    """Error and seconds of each law on the finest mesh of each scene."""
    laws = ("points", "nodes", "dual")
    heads = ["scene", "degree", "n", "law at points", "at nodes", "dual", "GetFEM"]
    lines = [[*heads, "GetFEM's time over ours"]]
    for scene, name in SCENES.items():
        kinds = grouped(of(rows, scene=scene), "role", "degree")
        for (role, degree), found in kinds:
            n = max((row["n"] for row in found), key=int)
            own = {(r["program"], r["law"]): r for r in of(found, n=n)}
            keys = [("raymortar", law) for law in laws] + [("GetFEM", "points")]
            cells = [_error_in(own.get(key)) for key in keys]
            ratio = ""
            if "solution" not in cells[-1] and keys[-1] in own:
                times = [float(own[key]["seconds"]) for key in (keys[-1], keys[0])]
                ratio = f"{times[0] / times[1]:.1f}"
            title = f"{name}, {role}" if role else name
            lines.append([title, degree, n, *cells, ratio])
    return lines


def _error_in(row: Row | None) -> str:
    """An error and its seconds."""
    if row is None:
        return ""
    seconds, error = float(row["seconds"]), float(row["error"])
    if error > 1.0:
        return "another solution"
    small = f"{100 * error:.1e} %".replace("e-0", "e-")
    shown = percent(row["error"]) if error > 5e-4 else small
    return f"{shown}, {shaped(seconds, 2)} s"
