"""Plots of error over run time, and the tables that go with them."""

from __future__ import annotations

from pathlib import Path

import drawing
import numpy as np
from clock import STAGES

LEVELS = (1e-2, 1e-3, 1e-4)
TITLES = {
    "B1": "A cube on a rigid surface",
    "B2": "A square on a rigid parabola",
    "B4": "Two squares after a slide along a curved interface",
}
LOOK = {1: "o", 2: "s"}


def pareto(found, error):
    """Rows that no other one beats in both time and error, by time."""
    front, least = [], float("inf")
    for row in sorted(found, key=lambda r: (r["seconds"], r[error])):
        if row[error] < least:
            front.append(row)
            least = row[error]
    return front


def seconds_at(found, error, level):
    """Least run time with an error below a level, between sizes on log scales; None if
    it is not reached."""
    front = pareto(found, error)
    e = np.log([row[error] for row in front])
    t = np.log([row["seconds"] for row in front])
    if not front or e[-1] > np.log(level):
        return None
    below = int(np.argmax(e <= np.log(level)))
    if below == 0:
        return float(np.exp(t[0]))
    share = (e[below - 1] - np.log(level)) / (e[below - 1] - e[below])
    return float(np.exp(t[below - 1] + share * (t[below] - t[below - 1])))


def of(found, **values):
    """Rows with these settings."""
    return [r for r in found if all(r[name] == v for name, v in values.items())]


def draw(found, output: Path):
    """All plots for which there are results, as PNG."""
    plt = drawing.pyplot()
    for problem in ("B1", "B2", "B4"):
        if of(found, problem=problem, program="raymortar"):
            _fronts(plt, found, problem, output / f"pareto_{problem}.png")
    if of(found, program="GetFEM"):
        _peer(plt, found, output / "getfem.png")
        print(peer_table(found))
    print(rate_table(found))
    print(faceted_table(found))
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
        ax.set(xlabel="processor time [s]", ylabel=f"relative error of the {name}")
    axes[0].legend(fontsize=8)
    _shares(axes[2], mine)
    fig.suptitle(f"{TITLES[problem]}: all settings")
    fig.tight_layout()
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
    axes.set(ylabel="share of the time [%]", xlabel="cells, degree, unknowns")
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
        ax.set(title=TITLES[problem], xlabel="processor time [s]")
        ax.set(ylabel="relative error of the displacement")
        ax.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    fig.tight_layout()
    fig.savefig(path, dpi=110)
    plt.close(fig)


def _kinds(found, problem):
    pairs = sorted({(r["cell"], r["degree"]) for r in of(found, problem=problem)})
    return [{"cell": c, "degree": d} for c, d in pairs]


def peer_table(found) -> str:
    """Seconds at which each program reaches the levels of error, as Markdown."""
    shown = [r for r in found if "flat" in r["mesh"]]
    lines = ["| problem | cell, degree | program | 1 % | 0.1 % | 0.01 % |"]
    lines.append("|---|---|---|---|---|---|")
    for problem in sorted({r["problem"] for r in shown}):
        for kind in _kinds(shown, problem):
            for program in ("raymortar", "GetFEM"):
                part = of(shown, problem=problem, program=program, **kind)
                times = [seconds_at(part, "error_u", level) for level in LEVELS]
                cells = ["-" if t is None else f"{t:.3g}" for t in times]
                name = f"{kind['cell']} {kind['degree']:g}"
                lines.append(
                    f"| {problem} | {name} | {program} | {' | '.join(cells)} |"
                )
    return "\n".join(lines)


def rate_table(found) -> str:
    """Mean orders of convergence between the first and the last mesh with defaults,
    and the errors of the last, as Markdown."""
    lines = ["| problem | cell, degree | mesh | n | u | grad u | multiplier | errors |"]
    lines.append("|---|---|---|---|---|---|---|---|")
    names = ("error_u", "error_H", "error_multiplier")
    shown = of(found, program="raymortar", quadrature="default", method="augmented")
    shown = of(shown, measure="reference", multiplier="normal", tangent="default")
    keys = ("problem", "cell", "degree", "mesh")
    for key in sorted({tuple(r[k] for k in keys) for r in shown}):
        part = sorted(of(shown, **dict(zip(keys, key))), key=lambda r: r["n"])
        if key[0].startswith("D") or len(part) < 2:
            continue
        first, last = part[0], part[-1]
        halvings = np.log2(last["n"] / first["n"])
        orders = [np.log2(first[e] / last[e]) / halvings for e in names]
        orders = " | ".join(f"{order:.2f}" for order in orders)
        errors = ", ".join(f"{last[e]:.1e}" for e in names)
        sizes = f"{first['n']:g} to {last['n']:g}"
        name = f"{key[1]} {key[2]:g}"
        lines.append(
            f"| {key[0]} | {name} | {key[3]} | {sizes} | {orders} | {errors} |"
        )
    return "\n".join(lines)


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


def faceted_table(found) -> str:
    """Errors of degree 1 on a rigid master that is exact, and on one of flat facets,
    as Markdown."""
    found = of(found, program="raymortar", quadrature="default", method="augmented")
    found = of(found, degree=1.0, measure="reference", tangent="default")
    exact = of(found, mesh="regular", multiplier="normal")
    names = ("error_u", "error_multiplier")
    heads = ("problem", "cell", "n", "u: exact", "faceted", "multiplier: exact")
    lines = [f"| {' | '.join(heads)} | faceted |"]
    lines.append("|---|---|---|---|---|---|---|")
    for row in of(found, mesh="regular, flat master"):
        same = {key: row[key] for key in ("problem", "cell", "n")}
        for twin in of(exact, **same):
            pairs = [f"{twin[name]:.1e} | {row[name]:.1e}" for name in names]
            first = " | ".join((row["problem"], row["cell"], f"{row['n']:g}"))
            lines.append(f"| {first} | {' | '.join(pairs)} |")
    return "\n".join(lines)
