"""Tables of cases of other codes: their figures and ours, and where they are from."""

from __future__ import annotations

from .formats import Row, Table, grouped, once, percent, table

# Columns of the laws that most cases are solved with
LAWS = {"points": "at points", "dual": "by dual functions"}


def number(value: str) -> str:
    """Six digits of a figure, and zero for what rounding leaves."""
    return "0" if abs(float(value)) < 1e-30 else f"{float(value):.6g}"


def deviation(value: str) -> str:
    """Per cent with a sign, or the power of ten of a small one."""
    size = abs(float(value))
    if size < 1e-12:
        return "0"
    return percent(value, signed=True) if size >= 1e-5 else f"{float(value):.0e}"


def titled(name: str) -> str:
    """Name of a case in words."""
    return name.replace("_", " ")


@table("field/cases.csv")
def other_codes(rows: list[Row]) -> Table:
    """Figures by case: the source's, and ours by each law with the deviation."""
    lines = [["case", "quantity", "reference", *LAWS.values(), "other laws"]]
    names = []
    for (name,), group in grouped(rows, "case"):
        for quantity in dict.fromkeys(row["quantity"] for row in group):
            found = [row for row in group if row["quantity"] == quantity]
            cells = dict.fromkeys([*LAWS, ""], "")
            for row in found:
                law = row["law"] if row["law"] in LAWS else ""
                shown = f"{number(row['ours'])} ({deviation(row['deviation'])})"
                if not law and row["law"]:
                    shown = f"{row['law']}: {shown}"
                cells[law] = shown
            names.append(titled(name))
            lines.append(["", quantity, number(found[0]["reference"]), *cells.values()])
    for line, name in zip(lines[1:], once(names)):
        line[0] = name
    return lines


@table("field/cases.csv")
def other_codes_sources(rows: list[Row]) -> Table:
    """Where the cases are from, the iterations that they take, and verdicts."""
    lines = [["case", "code", "source", "scene", "iterations", "why figures differ"]]
    for (name,), group in grouped(rows, "case"):
        first = group[0]
        efforts = dict.fromkeys(f"{row['law']}: {row['iterations']}" for row in group)
        lines.append(
            [
                titled(name),
                first["code"],
                f"`{first['source']}`" if "/" in first["source"] else first["source"],
                first["scene"],
                "; ".join(effort.removeprefix(": ") for effort in efforts),
                next((row["verdict"] for row in group if row["verdict"]), ""),
            ]
        )
    return lines
