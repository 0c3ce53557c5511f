"""Tables of laws at points and at nodes."""

from __future__ import annotations

from math import isnan

from .formats import Row, Table, brief, grouped, halved, percent, table

CONDITIONS = ("points", "nodes", "dual")
# What a scene's name ends with: how its figure is shown
FIGURES = {"V": lambda value: f"{float(value):.1f}"}


def _figure(scene: str, value: str) -> str:
    if isnan(float(value)):
        return ""
    _, _, quantity = scene.partition("; ")
    return FIGURES.get(quantity, percent)(value)


@table("parameters/conditions.csv")
def conditions(rows: list[Row]) -> Table:
    """Iterations, figures and seconds of paths."""
    head = ["", *CONDITIONS, *(f"figure, {name}" for name in CONDITIONS), "seconds"]
    lines = [head]
    for (scene,), found in grouped(rows, "scene"):
        counts = [halved(row["iterations"], row["halved"] or "0") for row in found]
        figures = [_figure(scene, row["figure"]) for row in found]
        seconds = ", ".join(row["seconds"] for row in found)
        lines.append([scene, *counts, *figures, seconds])
    return lines


@table("parameters/partial_slip.csv")
def partial_slip(rows: list[Row]) -> Table:
    """Work of a cycle over gamma, and the zone that sticks."""
    lines = [
        [
            "facets across, Q / (mu P)",
            "law",
            "loop: gamma x 0.1",
            "x 1",
            "x 10",
            "zone that sticks, x 1",
            "Cattaneo and Mindlin",
            "a facet",
            "iterations",
        ]
    ]
    for (facets, share, law), found in grouped(rows, "facets", "share", "condition"):
        one = found[1]
        lines.append(
            [
                f"{facets}, {share}",
                law,
                *(brief(row["loop"], 6) if row["loop"] else "fails" for row in found),
                *(f"{float(one[name]):.3f}" for name in ("stick", "mindlin", "facet")),
                ", ".join(row["iterations"] for row in found),
            ]
        )
    return lines
