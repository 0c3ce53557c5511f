"""Heat map of the stress matrix: verdict by colour, iterations in the cells."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
from cases import CELL, PANELS, settings  # noqa: E402
from matplotlib.patches import Patch  # noqa: E402

COLOURS = {
    "one step": "#1a9850",
    "line search": "#91cf60",
    "steps": "#fee08b",
    "steps with line search": "#fdae61",
    "growing steps": "#e6ab02",
    "another equilibrium": "#74add1",
    "no reference": "#d9d9f0",
    "wrong, with a warning": "#f4a6a0",
    "fails": "#bdbdbd",
    "fails without a reason": "#c51b7d",
    "wrong": "#d73027",
    "hangs": "#762a83",
    "crashes": "#000000",
}


def _label(value):
    if isinstance(value, tuple) and isinstance(value[0], str):
        return f"{value[0]} {value[1]}"
    if isinstance(value, tuple):
        return f"{value[0]}:{value[1]}"
    if isinstance(value, str):
        return value
    return f"{value:g}"


def _panel(axes, name, answers):
    _, (down, rows), (across, columns) = PANELS[name]
    for i, row in enumerate(settings(name)):
        for j, setting in enumerate(row):
            answer = answers[setting]
            colour = COLOURS[answer["verdict"]]
            axes.add_patch(plt.Rectangle((j, i), 1, 1, color=colour, ec="white"))
            text = str(answer.get("iterations", ""))
            axes.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=8)
    axes.set_xlim(0, len(columns))
    axes.set_ylim(0, len(rows))
    axes.set_xticks([j + 0.5 for j in range(len(columns))], map(_label, columns))
    axes.set_yticks([i + 0.5 for i in range(len(rows))], map(_label, rows))
    axes.tick_params(labelsize=8, length=0)
    axes.set_title(name, fontsize=10)
    axes.set_xlabel(across, fontsize=9)
    axes.set_ylabel(down if isinstance(down, str) else "", fontsize=9)


def draw(panels, answers, path):
    """One panel per pair of parameters, two side by side: a page each of `path`, of
    triangles, and of a file named after it, of all cells."""
    cells = [name for name in panels if PANELS[name][1][0] == CELL]
    plain = [name for name in panels if name not in cells]
    for chosen, target in (
        (plain, path),
        (cells, path.with_name(f"{path.stem}_cells{path.suffix}")),
    ):
        if chosen:
            _page(chosen, answers, target)


def _page(panels, answers, path):
    rows = -(-len(panels) // 2)
    height = 2.3 * rows + 0.6
    figure, axes = plt.subplots(rows, 2, figsize=(8.0, height), squeeze=False)
    for axis in axes.flat[len(panels) :]:
        axis.axis("off")
    for axis, name in zip(axes.flat, panels):
        _panel(axis, name, answers)
    seen = {answers[s]["verdict"] for n in panels for row in settings(n) for s in row}
    figure.legend(
        handles=[Patch(color=c, label=v) for v, c in COLOURS.items() if v in seen],
        loc="lower center",
        ncol=min(len(seen), 4),
        fontsize=9,
    )
    figure.tight_layout(rect=(0, 0.6 / height, 1, 1))
    figure.savefig(path, dpi=100)
    plt.close(figure)
