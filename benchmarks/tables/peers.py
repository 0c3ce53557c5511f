"""Tables of the scenes that three programs solve."""

from __future__ import annotations

from .formats import Row, Table, grouped, once, percent, shaped, table

TITLES = {
    "patch": "patch",
    "hertz_2d": "cylinder on block",
    "hertz_3d": "ball on block",
    "blocks": "blocks",
    "ironing": "ironing",
}


def _error(row: Row) -> str:
    if row["failed"]:
        return "fails"
    if not row["error"]:
        return ""
    small = float(row["error"]) < 1e-4
    return f"{float(row['error']):.1e}" if small else percent(row["error"])


@table("peers/peers.csv")
def peers(rows: list[Row]) -> Table:
    """Error, seconds and iterations of all programs on the same meshes and steps."""
    lines = [
        ["scene, degree", "n", "program", "error", "V", "H", "increments"]
        + ["iterations", "cutbacks", "CPU seconds", "runs"]
    ]
    order = list(TITLES)
    rows = sorted(
        rows, key=lambda r: (order.index(r["scene"]), r["degree"], int(r["n"]))
    )
    names = [f"{TITLES[row['scene']]}, {row['degree']}" for row in rows]
    for name, row in zip(once(names), rows):
        flat = row["scene"] in ("blocks", "ironing")
        forces = [row["vertical"], row["horizontal"] if flat else ""]
        lines.append(
            [
                name,
                row["n"] + (f", steps x {row['more']}" if row["more"] != "1" else ""),
            ]
            + [f"{row['program']}, {row['form']}, {row['setting']}", _error(row)]
            + [shaped(float(force), 4) if force else "" for force in forces]
            + [row["increments"], row["iterations"], row["cutbacks"]]
            + [shaped(float(row["seconds"]), 3) if row["seconds"] else ""]
            + [row["turns"]]
        )
    return lines


@table("peers/peers.csv")
def peer_failures(rows: list[Row]) -> Table:
    """What did not arrive, in the words of each program."""
    lines = [["scene, degree", "n", "program", "ends"]]
    for row in rows:
        if row["failed"]:
            says = " ".join(row["failed"].replace("|", "/").split())
            name = f"{TITLES[row['scene']]}, {row['degree']}"
            program = f"{row['program']}, {row['form']}, {row['setting']}"
            lines.append([name, row["n"], program, says])
    return lines


@table("peers/peers.csv")
def increments(rows: list[Row]) -> Table:
    """Change of the forces at the end where the path has more steps."""
    lines = [["scene", "n", "program", "steps", "V", "H"]]
    keys = ("scene", "n", "program", "form", "setting", "degree")
    kept = sorted(
        (r for r in rows if not r["failed"]), key=lambda r: [r[k] for k in keys]
    )
    for (scene, n, program, form, setting, _), found in grouped(kept, *keys):
        few, *many = sorted(found, key=lambda row: int(row["more"]))
        for row in many:
            changes = [
                percent(float(row[name]) / float(few[name]) - 1.0, signed=True)
                if name == "vertical" or scene in ("blocks", "ironing")
                else ""
                for name in ("vertical", "horizontal")
            ]
            steps = f"{row['increments']} for {few['increments']}"
            name = f"{program}, {form}, {setting}"
            lines.append([TITLES[scene], n, name, steps, *changes])
    return lines
