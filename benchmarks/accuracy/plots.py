"""Plots of error over run time. `scripts/measured` makes the tables."""

from __future__ import annotations

from pathlib import Path

import drawing
from clock import STAGES
from fronts import of, pareto, seconds_at

TITLES = {
    "B1": "A cube on a rigid surface",
    "B2": "A square on a rigid parabola",
    "B4": "Two squares after a slide along a curved interface",
}
LOOK = {1: "o", 2: "s"}


def draw(found, output: Path):
    """All plots for which there are results, as PNG."""
    plt = drawing.pyplot()
    for problem in ("B1", "B2", "B4"):
        if of(found, problem=problem, program="raymortar"):
            _fronts(plt, found, problem, output / f"pareto_{problem}.png")
    if of(found, program="GetFEM"):
        _peer(plt, found, output / "getfem.png")
    _quadrature(plt, found, output / "quadrature.png")


def _fronts(plt, found, problem, path):
    """Every setting's errors over time; the fronts and the shares of the stages."""
    mine = of(found, problem=problem, program="raymortar")
    mine = [r for r in mine if "flat" not in r["mesh"]]
    fig, axes = plt.subplots(1, 3, figsize=(13, 4.2))
    for ax, error, name in (
        (axes[0], "error_u", "displacement"),
        (axes[1], "error_multiplier", "multiplier"),
    ):
        shown = [r for r in mine if r[error] != ""]
        for cell in sorted({r["cell"] for r in shown}):
            for degree in (1.0, 2.0):
                part = of(shown, cell=cell, degree=degree)
                x, y = [r["seconds"] for r in part], [r[error] for r in part]
                label = f"{cell}, degree {degree:g}"
                ax.loglog(x, y, LOOK[int(degree)], ms=4, mfc="none", label=label)
        front = pareto(shown, error)
        x, y = [r["seconds"] for r in front], [r[error] for r in front]
        ax.loglog(x, y, "k-", lw=1, label="Pareto front")
        ax.set(xlabel="processor time (s)", ylabel=f"relative error of the {name}")
    _shares(axes[2], mine)
    fig.suptitle(f"{TITLES[problem]}: all settings")
    fig.tight_layout()
    below = {"loc": "upper center", "bbox_to_anchor": (0.32, 0.02)}
    handles, labels = axes[0].get_legend_handles_labels()
    fig.legend(handles, labels, fontsize=8, ncols=5, **below)
    fig.savefig(path, dpi=110)
    plt.close(fig)


def _shares(axes, found):
    """Stages of the largest run of each kind with all defaults."""
    found = of(found, quadrature="default", method="augmented")
    kinds = sorted({(r["cell"], r["degree"]) for r in found})
    bottom = [0.0] * len(kinds)
    largest = [
        max(of(found, cell=c, degree=d), key=lambda r: r["unknowns"]) for c, d in kinds
    ]
    sizes = [f"{r['unknowns']:,.0f}" for r in largest]
    labels = [f"{c}s\ndegree {d:g}\n{n}" for (c, d), n in zip(kinds, sizes)]
    for stage in STAGES:
        share = [100.0 * r[stage] / r["seconds"] for r in largest]
        axes.bar(labels, share, bottom=bottom, label=stage, width=0.6)
        bottom = [a + b for a, b in zip(bottom, share)]
    axes.set(ylabel="share of the time (%)", xlabel="cells, degree, unknowns")
    axes.tick_params(axis="x", labelsize=7)
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))


def _peer(plt, found, path):
    """Both programs on the same meshes."""
    shown = [r for r in found if "flat" in r["mesh"]]
    problems = sorted({r["problem"] for r in shown})
    fig, axes = plt.subplots(1, len(problems), figsize=(8 * len(problems), 4.2))
    for ax, problem in zip(axes if len(problems) > 1 else [axes], problems):
        for i, kind in enumerate(_kinds(shown, problem)):
            for program, style in (("raymortar", "-"), ("GetFEM", "--")):
                part = of(shown, problem=problem, program=program, **kind)
                part = [r for r in part if r["quadrature"] in ("default", "4")]
                part.sort(key=lambda r: r["n"])
                x, y = [r["seconds"] for r in part], [r["error_u"] for r in part]
                label = f"{program}: {kind['cell']}, degree {kind['degree']:g}"
                marker = LOOK[int(kind["degree"])] + style
                ax.loglog(x, y, marker, color=f"C{i}", ms=4, mfc="none", label=label)
        ax.set(title=TITLES[problem], xlabel="processor time (s)")
        ax.set(ylabel="relative error of the displacement")
        ax.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    fig.tight_layout()
    fig.savefig(path, dpi=110)
    plt.close(fig)


def _kinds(found, problem):
    pairs = sorted({(r["cell"], r["degree"]) for r in of(found, problem=problem)})
    return [{"cell": c, "degree": d} for c, d in pairs]


def _quadrature(plt, found, path):
    """Error of the multiplier over the degree of the rule."""
    shown = [r for r in found if r["quadrature"] not in ("default", "")]
    shown = [r for r in shown if r["mesh"] == "shaken"]
    if not shown:
        return
    problems = ("B2", "B4", "B1")
    fig, axes = plt.subplots(1, len(problems), figsize=(13, 4.2))
    for ax, problem in zip(axes, problems):
        for kind in _kinds(shown, problem):
            part = of(shown, problem=problem, **kind)
            part.sort(key=lambda r: float(r["quadrature"]))
            x = [float(r["quadrature"]) for r in part]
            label = f"{kind['cell']}, degree {kind['degree']:g}"
            y = [r["error_multiplier"] for r in part]
            ax.semilogy(x, y, LOOK[int(kind["degree"])] + "-", ms=4, label=label)
        ax.set(title=TITLES[problem], xlabel="degree of the rule on segments")
        ax.set(ylabel="relative error of the multiplier")
        ax.legend(fontsize=7)
    fig.tight_layout()
    fig.savefig(path, dpi=110)
    plt.close(fig)
