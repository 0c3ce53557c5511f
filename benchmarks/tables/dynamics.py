"""Tables of motion: impacts in each scheme, and their cost."""

from __future__ import annotations

from .formats import Row, Table, brief, once, percent, spaced, table


@table("dynamics/impacts.csv")
def impacts(rows: list[Row]) -> Table:
    """Energy, force and impulse of impacts by scheme, mass and step."""
    head = "scheme|mass|$c\\, \\Delta t / h$|energy at the end|largest|stress|ripple|impulse"
    lines, names = [head.split("|")], []
    for row in rows:
        if row["case"] != "bars" or row["cell"] != "quadrilateral":
            continue
        names.append(row["scheme"])
        energies = [f"{float(row[name]):.4f}" for name in ("energy", "most")]
        others = [f"{float(row['stress']):.4f}", percent(row["ripple"])]
        lines.append(
            [
                "",
                row["mass"],
                row["cfl"],
                *energies,
                *others,
                f"{float(row['impulse']):.3f}",
            ]
        )
    for line, name in zip(lines[1:], once(names)):
        line[0] = name
    return lines


@table("dynamics/impacts.csv")
def drops(rows: list[Row]) -> Table:
    """A bar that drops on a plane, by scheme, mass and step."""
    head = "scheme|mass|$c\\, \\Delta t / h$|energy|pressure|ripple|impulse|loss of rebound"
    lines, names = [head.split("|")], []
    for row in rows:
        if row["case"] == "drop":
            names.append(row["scheme"])
            shares = [f"{float(row[name]):.4f}" for name in ("energy", "stress")]
            lines.append(
                ["", row["mass"], row["cfl"], *shares, percent(row["ripple"]),
                 f"{float(row['impulse']):.3f}", percent(row["momentum"])]
            )  # fmt: skip
    for line, name in zip(lines[1:], once(names)):
        line[0] = name
    return lines


@table("dynamics/impacts.csv")
def step_costs(rows: list[Row]) -> Table:
    """Milliseconds of a step beside one of the bodies alone."""
    lines = [["unknowns", "bodies alone", "apart", "in contact", "apart / alone"]]
    for cell in dict.fromkeys(row["cell"] for row in rows):
        found: dict[str, float] = {}
        for row in rows:
            if row["cell"] == cell and row["case"] != "drop":
                found.setdefault(row["case"], 1e3 * float(row["seconds"]))
                count = row["unknowns"]
        cells = [brief(found[case]) for case in ("alone", "apart", "bars")]
        lines.append([spaced(count), *cells, brief(found["apart"] / found["alone"])])
    return lines


@table("dynamics/bouncing.csv")
def bounces(rows: list[Row]) -> Table:
    """A body that bounces for long: energy and memory."""
    lines = [["steps", "bounces", "energy that is missing", "memory, kB"]]
    tenth = max(len(rows) // 10, 1)
    for row in [rows[0], *rows[tenth::tenth]]:
        missing = percent(-float(row["energy"]), signed=True)
        lines.append(
            [spaced(row["step"]), row["bounces"], missing, spaced(row["kilobytes"])]
        )
    return lines
