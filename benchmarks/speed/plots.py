"""Seconds of the stages over the number of slave facets."""

from __future__ import annotations

# A call that finds nothing moved takes as long for any number of facets
LEFT_OUT = "s_unmoved"
LINES = ("-", "--")


def growth(rows, key, path):
    """One panel per kind of rows, one line per stage, logarithmic."""
    try:
        import matplotlib
    except ImportError:
        print("matplotlib is missing: no plots")
        return
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    groups = sorted({tuple(row[k] for k in key) for row in rows})
    width = 2 if len(groups) > 2 else len(groups)
    height = -(-len(groups) // width)
    fig, axes = plt.subplots(
        height,
        width,
        figsize=(4.5 * width, 3 * height + 0.6),
        sharex=True,
        squeeze=False,
    )
    for ax, group in zip(axes.ravel(), groups):
        own = [row for row in rows if tuple(row[k] for k in key) == group]
        facets = [row["facets"] for row in own]
        names = [n for n in own[0] if n.startswith("s_") and n != LEFT_OUT]
        for i, name in enumerate(names):
            # What was not timed is 0, which has no place on a logarithmic axis
            micro = [1e6 * row[name] / row["facets"] or float("nan") for row in own]
            style = {"color": f"C{i % 6}", "linestyle": LINES[i // 6], "marker": "."}
            ax.loglog(facets, micro, label=name[2:], **style)
        values = [v if isinstance(v, str) else f"degree {v:g}" for v in group]
        ax.set_title(", ".join(values), fontsize=10)
        ax.grid(True, which="both", alpha=0.2)
    for ax in axes[-1]:
        ax.set_xlabel("slave facets")
    for ax in axes[:, 0]:
        ax.set_ylabel("processor time per slave facet (us)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="lower center", ncol=6, fontsize=9)
    fig.tight_layout(rect=(0, 0.6 / (3 * height + 0.6), 1, 1))
    fig.savefig(path, dpi=110)
    plt.close(fig)
