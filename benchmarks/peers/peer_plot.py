"""One picture: error over whole processor seconds, all programs, a panel each scene."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "demos"))

import drawing  # noqa: E402

TITLES = {
    "patch": "patch test: largest error of the pressure",
    "hertz_2d": "cylinder on block: pressure in L2",
    "hertz_3d": "ball on block: pressure in L2",
    "blocks": "pressed and sheared blocks: forces",
    "ironing": "ironing: forces",
}
LOOK = {"raymortar": ("C0", "o"), "GetFEM": ("0.3", "x"), "CalculiX": ("C3", "s")}
LINES = ("-", "--", ":", "-.")


def draw(rows, path):
    """Scenes with an error, each in its panel."""
    plt = drawing.pyplot()
    from matplotlib.ticker import LogLocator, NullFormatter

    rows = [r for r in rows if r["error"] and float(r["error"]) > 0.0]
    scenes = [scene for scene in TITLES if any(r["scene"] == scene for r in rows)]
    if not scenes:
        print("no row has an error yet: no picture")
        return
    width = 4.2 * len(scenes) + 2.4
    figure, axes = plt.subplots(1, len(scenes), figsize=(width, 4.0), squeeze=False)
    for ax, scene in zip(axes[0], scenes):
        _curves(ax, [r for r in rows if r["scene"] == scene and r["more"] == "1"])
        ax.set(title=TITLES[scene], xlabel="processor time of the whole process (s)")
        ax.title.set_fontsize(9)
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.grid(True, which="both", alpha=0.2)
    axes[0, 0].set(ylabel="relative error")
    handles = {}
    for ax in axes[0]:
        handles |= dict(reversed(p) for p in zip(*ax.get_legend_handles_labels()))
    beside = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    figure.tight_layout()
    figure.legend(handles.values(), handles.keys(), fontsize=7, **beside)
    figure.savefig(path, dpi=100, bbox_inches="tight")
    plt.close(figure)


def _curves(ax, rows):
    """A line for each program's form, setting and degree."""
    kinds = dict.fromkeys(
        (r["program"], r["form"], r["setting"], r["degree"]) for r in rows
    )
    for program, form, setting, degree in kinds:
        own = [
            (float(r["seconds"]), float(r["error"]))
            for r in rows
            if (r["program"], r["form"], r["setting"], r["degree"])
            == (program, form, setting, degree)
        ]
        colour, marker = LOOK[program]
        forms = sorted({form for other, form, *_ in kinds if other == program})
        filled = {"mfc": colour if degree == "2" else "none"}
        style = LINES[forms.index(form) % len(LINES)]
        label = f"{program}, {form}, {setting}, degree {degree}"
        ax.loglog(
            *zip(*own), style, marker=marker, ms=5, color=colour, label=label, **filled
        )
