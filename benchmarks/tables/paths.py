"""Tables of load paths and line searches."""

from __future__ import annotations

from .formats import Row, Table, grouped, halved, table

PLURAL = {"tetrahedron": "tetrahedra", "hexahedron": "hexahedra"}


@table("parameters/growing_steps.csv")
def growing_steps(rows: list[Row]) -> Table:
    """Steps and iterations over `LoadSteps(largest=)`."""
    names = {
        "ironing, 60 x 15; V, H": (
            "ironing, 60 x 15 (20 steps down, 80 along)",
            "reactions at the end",
        ),
        "half ring; middle of the block": (
            "half ring, 64 steps",
            "middle of the block at the end",
        ),
    }
    lines = [["", "`largest=1`", "2", "4", "8"]]
    for (scene,), found in grouped(rows, "scene"):
        name, figure = names[scene]
        steps = [halved(row["steps"], row["halved"]) for row in found]
        figures = [row["figure"].replace(" ", ", ") for row in found]
        lines += [
            [f"{name}: steps", *steps],
            ["iterations", *(row["iterations"] for row in found)],
            [figure, *figures],
        ]
    return lines


@table("parameters/extrapolated.csv")
def extrapolated(rows: list[Row]) -> Table:
    """Iterations of ironing with extrapolated starts."""
    plain = [row for row in rows if row["extrapolate"] == "False"]
    head = [
        f"{row['steps_per_unit']} steps a unit, t in [1, {row['until']}]"
        for row in plain
    ]
    lines = [["", *head]]
    for name, value in (
        ("`extrapolate=False`", "False"),
        ("`extrapolate=True`", "True"),
    ):
        own = [row["iterations"] for row in rows if row["extrapolate"] == value]
        lines.append([name, *(f"{float(count):.1f}" for count in own)])
    return lines


@table("parameters/corrections.csv")
def corrections(rows: list[Row]) -> Table:
    """Paths with and without corrections by the same tangent."""
    lines = [["blocks", "unknowns", "tangents without", "with", "time with: without"]]
    for row in rows:
        cells = PLURAL.get(row["cell"], row["cell"] + "s")
        friction = f"mu = {row['mu']}" if float(row["mu"]) else "no friction"
        seconds = [float(row[f"{name}_seconds"]) for name in ("corrected", "plain")]
        lines.append(
            [
                f"{cells} of degree {row['degree']}, {friction}",
                row["unknowns"],
                row["plain_tangents"],
                row["corrected_tangents"],
                f"{seconds[0] / seconds[1]:.2f}",
            ]
        )
    return lines


@table("parameters/arriving.csv")
def arriving(rows: list[Row]) -> Table:
    """Scenes that have to arrive with nothing tuned."""
    lines = [["scene", "law", "iterations a step", "most", "tangents", "other ways"]]
    for row in rows:
        mean = f"{float(row['mean']):.1f}" if row["mean"] else ""
        steps = halved(row["steps"], row["halvings"])
        if row["arrived"] != "yes":
            steps += ", ends"
        scene = f"{row['scene']}: {steps}"
        known = row["law"], mean, row["most"], row["tangents"], row["ways"]
        lines.append([scene, *known])
    return lines


@table("parameters/statuses.csv")
def statuses(rows: list[Row]) -> Table:
    """Paths with multipliers, with and without statuses ahead."""
    lines = [
        ["path", "law", "unknowns", "iterations a step", "tangents", "seconds"],
    ]
    for row in rows:
        means = f"{float(row['plain_mean']):.1f}, **{float(row['mean']):.1f}**"
        tangents = f"{row['plain_tangents']}, **{row['tangents']}**"
        ratio = float(row["seconds"]) / float(row["plain_seconds"])
        known = row["scene"], row["law"], row["unknowns"]
        lines.append([*known, means, tangents, f"{ratio:.2f}"])
    return lines


@table("parameters/line_search.csv")
def line_search(rows: list[Row]) -> Table:
    """Iterations with line searches of PETSc."""
    kinds = ("basic", "bt", "l2", "cp")
    lines = [["", "full steps", "`bt`", "`l2`", "`cp`"]]
    for row in rows:
        lines.append(
            [
                row["scene"],
                *(halved(row[kind], row[f"{kind}_halved"]) for kind in kinds),
            ]
        )
    return lines


def _end(row: Row) -> str:
    if row["arrived"] == "yes":
        return f"{row['steps']} ({row['halvings']}), {row['all_iterations']}"
    return f"ends at {row['until']}, {row['all_iterations']}"


@table("robustness/paths.csv")
def paths(rows: list[Row]) -> Table:
    """Paths on which something is wrong, by halving and by the default."""
    lines = [["path", '`"halve"`', '`"auto"`', "steps that another way solved"]]
    for (path,), (halving, auto) in grouped(rows, "path"):
        falls = " fall" in path or path.startswith("pile")
        is_smooth = halving["arrived"] == "yes" and halving["halvings"] == "0"
        if not falls and not (is_smooth and not auto["used"]):
            lines.append([path, _end(halving), _end(auto), auto["used"] or "nothing"])
    return lines


@table("parameters/slip_fronts.csv")
def slip_fronts(rows: list[Row]) -> Table:
    """Tangents on a belt with and without soft stick."""
    lines = [
        [
            "cells, law",
            "starts",
            "path",
            "first step",
            "reversal",
            "the step after",
            "most of the others",
            "ratio of tensions",
        ]
    ]
    for (cells, law, ahead), found in grouped(
        rows, "cells", "condition", "extrapolate"
    ):
        start = "the default" if ahead == "" else "`extrapolate=False`"
        columns = "tangents", "first", "reversal", "next", "other"
        pairs = [", ".join(row[name] for row in found) for name in columns]
        lines.append([f"{cells}, {law}", start, *pairs, found[-1]["ratio"]])
    return lines
