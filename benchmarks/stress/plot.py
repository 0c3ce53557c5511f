"""Heat map of the stress matrix: verdict by colour, iterations in the cells."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402
from cases import PANELS, settings  # noqa: E402
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
            axes.text(j + 0.5, i + 0.5, text, ha="center", va="center", fontsize=6)
    axes.set_xlim(0, len(columns))
    axes.set_ylim(0, len(rows))
    axes.set_xticks([j + 0.5 for j in range(len(columns))], map(_label, columns))
    axes.set_yticks([i + 0.5 for i in range(len(rows))], map(_label, rows))
    axes.tick_params(labelsize=6, length=0)
    axes.set_title(name, fontsize=8)
    axes.set_xlabel(across, fontsize=7)
    axes.set_ylabel(down if isinstance(down, str) else "", fontsize=7)


def draw(panels, answers, path):
    """One panel per pair of parameters."""
    rows = -(-len(panels) // 3)
    figure, axes = plt.subplots(rows, 3, figsize=(10, 2.6 * rows), squeeze=False)
    for axis in axes.flat[len(panels) :]:
        axis.axis("off")
    for axis, name in zip(axes.flat, panels):
        _panel(axis, name, answers)
    seen = {answer["verdict"] for answer in answers.values()}
    figure.legend(
        handles=[Patch(color=c, label=v) for v, c in COLOURS.items() if v in seen],
        loc="lower center",
        ncol=min(len(seen), 6),
        fontsize=8,
    )
    figure.tight_layout(rect=(0, 0.3 / (2.6 * rows), 1, 1))
    figure.savefig(path, dpi=90)
