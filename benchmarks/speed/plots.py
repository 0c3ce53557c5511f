"""Seconds of the stages over the number of slave facets."""

from __future__ import annotations


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
        height, width, figsize=(4.5 * width, 3 * height), sharex=True, squeeze=False
    )
    for ax, group in zip(axes.ravel(), groups):
        own = [row for row in rows if tuple(row[k] for k in key) == group]
        facets = [row["facets"] for row in own]
        for name in [n for n in own[0] if n.startswith("s_")]:
            micro = [1e6 * row[name] / row["facets"] for row in own]
            ax.loglog(facets, micro, ".-", label=name[2:])
        ax.set_title(" ".join(str(g) for g in group), fontsize=9)
        ax.grid(True, which="both", alpha=0.2)
    for ax in axes[-1]:
        ax.set_xlabel("slave facets")
    for ax in axes[:, 0]:
        ax.set_ylabel("CPU us per slave facet")
    axes[0, -1].legend(fontsize=6, ncol=2)
    fig.tight_layout()
    fig.savefig(path, dpi=110)
    plt.close(fig)
