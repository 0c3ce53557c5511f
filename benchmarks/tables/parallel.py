"""Tables of ranks and linear solvers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from math import fsum

from .formats import Row, Table, brief, grouped, once, spaced, table


def _millions(count: str, digits: int) -> str:
    return f"{float(count) / 1e6:.{digits}f}e6"


def _digits(partition: str) -> int:
    return 1 if partition == "graph" else 2


def _exponent(rows: Sequence[Row], name: str) -> str:
    """Slope of a count over the slave facets, by least squares on log scales."""
    x = [math.log(float(row["slave_facets"])) for row in rows]
    y = [math.log(float(row[name])) for row in rows]
    x_mean, y_mean = fsum(x) / len(x), fsum(y) / len(y)
    slope = fsum((a - x_mean) * (b - y_mean) for a, b in zip(x, y)) / fsum(
        (a - x_mean) ** 2 for a in x
    )
    return "0" if abs(slope) < 1e-12 else f"{slope:.2f}"


@table("parallel/fixed_ranks.csv")
def sent_by_size(rows: list[Row]) -> Table:
    """What four ranks send, by the size of the surface."""
    names = (
        "fetched_facets update_messages update_bytes renewal_messages renewal_bytes"
        " assembly_messages matrix_bytes vector_bytes slid_matrix_bytes"
    ).split()
    lines = [
        [
            "partition",
            "slave facets",
            "fetched facets",
            "update: messages",
            "bytes",
            "renewal: messages",
            "bytes",
            "assembly: messages",
            "tangent, bytes",
            "residual, bytes",
            "tangent, slid",
        ]
    ]
    four = [row for row in rows if row["ranks"] == "4"]
    for (partition,), found in grouped(four, "partition"):
        for row in found:
            cells = [partition, spaced(row["slave_facets"])]
            for name in names:
                if name == "vector_bytes":
                    cells.append(_millions(row[name], 3))
                elif name == "slid_matrix_bytes":
                    cells.append(_millions(row[name], 1))
                elif name == "matrix_bytes":
                    cells.append(_millions(row[name], _digits(partition)))
                else:
                    cells.append(spaced(row[name]))
            lines.append(cells)
        lines.append(["", "exponent", *(_exponent(found, name) for name in names)])
    return lines


@table("parallel/fixed_share.csv")
def sent_by_ranks(rows: list[Row]) -> Table:
    """What ranks send that have the same number of facets on average."""
    lines = [
        [
            "partition",
            "ranks",
            "slave facets",
            "largest share",
            "fetched facets",
            "update: messages",
            "bytes",
            "renewal: messages",
            "bytes",
            "assembly: messages",
            "tangent, bytes",
            "tangent, slid",
        ]
    ]
    names = (
        "ranks slave_facets largest_share fetched_facets update_messages update_bytes"
        " renewal_messages renewal_bytes assembly_messages"
    ).split()
    for row in rows:
        if row["ranks"] != "1":
            digits = _digits(row["partition"])
            sent = _millions(row["matrix_bytes"], digits)
            slid = _millions(row["slid_matrix_bytes"], 1)
            lines.append(
                [row["partition"], *(spaced(row[name]) for name in names), sent, slid]
            )
    return lines


@table("parallel/ranks.csv")
def iterations_by_ranks(rows: list[Row]) -> Table:
    """GMRES iterations of `"bodies"` over the ranks."""
    first = [row for row in rows if row["ranks"] == "1"]
    heads = [
        f"degree {row['degree']}, {row['method']}, {row['friction']}" for row in first
    ]
    lines = [["ranks", *heads]]
    for (ranks,), found in grouped(rows, "ranks"):
        lines.append([ranks, *(f"{float(row['krylov_mean']):.1f}" for row in found)])
    return lines


@table("parallel/kept.csv")
def kept_factors(rows: list[Row]) -> Table:
    """Whole paths with MUMPS and with factors that are kept."""
    names = {
        "hertz": "Hertz, two spheres",
        "cattaneo-mindlin": "Cattaneo and Mindlin, spheres with friction",
        "cone": "rigid cone (the wedge of 3D)",
        "ironing": "ironing with friction",
    }
    lines = [
        [
            "path",
            "unknowns",
            "steps",
            "Newton iterations",
            "MUMPS: s",
            "MB",
            "kept factors: s",
            "MB",
            "times faster",
        ]
    ]
    for case, name in names.items():
        own = sorted(
            (row for row in rows if row["case"] == case),
            key=lambda row: int(row["unknowns"]),
        )
        for (unknowns,), (direct, kept) in grouped(own, "unknowns"):
            ratio = float(direct["seconds"]) / float(kept["seconds"])
            cells = [name, spaced(unknowns), direct["steps"], direct["newton"]]
            for row in (direct, kept):
                cells += [f"{float(row['seconds']):.1f}", row["megabytes"]]
            lines.append([*cells, f"**{ratio:.1f}**"])
    return lines


@table("parallel/lagged.csv")
def lagged_factors(rows: list[Row]) -> Table:
    """Whole paths with MUMPS and with lagged factors."""
    names = {
        "flat": "shallow ironing, 2D, 40 steps",
        "solid": "ironing, 3D, hexahedra 1, 14 steps",
    }
    lines = [
        [
            "path",
            "unknowns",
            "Newton: MUMPS",
            "s",
            "Newton: lagged",
            "factorisations",
            "GMRES, each",
            "s",
            "times faster",
        ]
    ]
    pairs = list(zip(rows[::2], rows[1::2]))
    for name, (direct, lagged) in zip(
        once(names[row["case"]] for row, _ in pairs), pairs
    ):
        ratio = float(direct["seconds"]) / float(lagged["seconds"])
        faster = f"{ratio:.1f}"
        lines.append(
            [
                name,
                spaced(direct["unknowns"]),
                direct["newton"],
                _seconds(direct["seconds"]),
                lagged["newton"],
                lagged["factorisations"],
                lagged["krylov"],
                _seconds(lagged["seconds"]),
                f"**{faster}**" if faster != "1.0" else faster,
            ]
        )
    return lines


def _seconds(value: str) -> str:
    """Seconds to a tenth, from a hundred on to a second."""
    return f"{float(value):.0f}" if float(value) >= 100 else f"{float(value):.1f}"


@table("parallel/condensed.csv")
def condensed_contact(rows: list[Row]) -> Table:
    """Krylov iterations of condensed contact beside those of its bodies."""
    lines = [
        ["cells", "master", "friction", "unknowns", "Newton", "hypre"]
        + ["condensed", "most", "s", "alone", "times alone"]
    ]
    names = {"hexahedron": "hexahedra", "tetrahedron": "tetrahedra"}
    for row in rows:
        ratio = float(row["condensed"]) / float(row["alone"])
        cells = [f"{names[row['cell']]} {row['degree']}", row["master"]]
        cells += [row["friction"], spaced(row["unknowns"]), row["newton"]]
        cells += [row["hypre"], f"**{row['condensed']}**", row["most"]]
        lines.append([*cells, row["seconds"], row["alone"], f"{ratio:.2f}"])
    return lines


# Rows that the page shows of the older options, by method and friction
_SHOWN = {("augmented", "none"): (12535, 88039, 284119)}
_SHOWN |= {("augmented", "Coulomb"): (89289,)}
_SHOWN |= {("penalty", friction): (87414,) for friction in ("none", "Coulomb")}


@table("parallel/linear.csv")
def older_options(rows: list[Row]) -> Table:
    """MUMPS beside the older options of `iterative`, whole solves."""
    lines = [["method", "friction", "unknowns", "Newton", "MUMPS: s"]]
    for name in ("gamg", "gamg-bounded", "hypre"):
        lines[0] += [f"{name}: iterations", "s"]
    for (method, friction), sizes in _SHOWN.items():
        for size in map(str, sizes):
            key = (method, friction, size)
            own = {
                row["linear"]: row
                for row in rows
                if (row["method"], row["friction"], row["unknowns"]) == key
            }
            direct = own["mumps"]
            cells = [method, friction, spaced(size), direct["newton"]]
            cells.append(brief(direct["seconds"], 3))
            for name in ("gamg", "gamg-bounded", "hypre"):
                row = own.get(name)
                cells += (
                    [row["krylov_mean"], brief(row["seconds"], 3)] if row else ["", ""]
                )
            lines.append(cells)
    return lines


@table("parallel/strong.csv")
def strong(rows: list[Row]) -> Table:
    """What one problem on more and more ranks gives each of them, and what it sends."""
    lines = [
        ["unknowns", "partition", "ranks", "slave facets: largest share", "mean"]
        + ["ranks without", "values, bytes", "tangent, bytes", "residual, bytes"]
        + ["Krylov iterations"]
    ]
    sent = ("value_bytes", "matrix_bytes", "vector_bytes")
    for row in rows:
        cells = [spaced(row["unknowns"]), row["partition"], row["ranks"]]
        cells += [row["largest_share"], brief(row["mean_share"], 3), row["without"]]
        lines.append([*cells, *(spaced(row[name]) for name in sent), row["krylov"]])
    return lines


@table("parallel/set_up.csv")
def set_up(rows: list[Row]) -> Table:
    """The share of multigrid's set-up in whole solves, and its parts."""
    parts = ("levels", "springs", "products", "near")
    lines = [
        ["cells, degree", "friction", "ranks", "unknowns", "Krylov", "all, s"]
        + ["assembly", "**set-up**", *parts, "cycles", "MB"]
    ]
    for row in rows:
        shares = {
            k: f"{100.0 * float(row[k]) / float(row['all']):.0f} %"
            for k in ("assembly", "set_up", *parts, "cycles")
        }
        name = {"hexahedron": "hexahedra", "tetrahedron": "tetrahedra"}[row["cell"]]
        cells = [f"{name} {row['degree']}", row["friction"], row["ranks"]]
        cells += [
            spaced(row["unknowns"]),
            row["krylov"].replace(" ", ", "),
            _seconds(row["all"]),
        ]
        cells += [shares["assembly"], f"**{shares['set_up']}**"]
        cells += [*(shares[k] for k in parts), shares["cycles"], row["megabytes"]]
        lines.append(cells)
    return lines
