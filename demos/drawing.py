"""Pictures of the demos: their look, states along a path, bodies beside a curve."""

from __future__ import annotations

import numpy as np

import raymortar
from raymortar.plotting.drawing import LOOK, PRESSURE_MAP, draw_field
from raymortar.plotting.gathering import gather, gather_boundary, gather_cells

__all__ = [
    "COMPUTED",
    "EXACT",
    "PRESSURE_MAP",
    "animate",
    "beside",
    "field_and_curve",
    "field_and_tractions",
    "draw_field",
    "gather_boundary",
    "gather_cells",
    "gather_states",
    "polygons_and_curve",
    "pyplot",
    "side_by_side",
    "states_and_curve",
]

# Red for computed, dark for closed forms
COMPUTED, EXACT = "#c0392b", "#2c3e50"


def gather_states(u, states, field):
    """Cells with u and a field at several states. Collective.

    `states` are (load factor, array of u); `field` makes a function of the present u.
    """
    final, parts = u.x.array.copy(), []
    for factor, state in states:
        u.x.array[:] = state
        parts.append((factor, gather_cells(u.function_space.mesh, u, field())))
    u.x.array[:] = final
    return parts


def pyplot():
    """matplotlib.pyplot without a screen, with our look."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams.update(LOOK)
    return plt


def field_and_tractions(path, contact, f, label, line=None):
    """Picture of deformed plane bodies with a field, and of tractions at the points in
    contact as arrows. A line (x, y) may be drawn beside the bodies. Collective."""
    comm, found = contact.u.function_space.mesh.comm, []
    for points in map(contact.points, range(len(contact.zones))):
        closed = points["status"] >= raymortar.results.Status.STICK
        found.append([points[name][closed] for name in ("x", "traction")])
    feet, arrows = (gather(comm, np.concatenate(one)) for one in zip(*found))
    x, moved, values = gather_cells(f.function_space.mesh, contact.u, f)
    if comm.rank > 0:
        return
    at = x[..., :2] + moved
    fig, (left, right) = pyplot().subplots(
        1, 2, figsize=(11, 3.9), layout="constrained", sharex=True, sharey=True
    )
    colours = draw_field(left, at, values)
    fig.colorbar(colours, ax=left, label=label, shrink=0.8)
    right.fill(*np.moveaxis(at, (0, 1), (1, 0)).transpose(2, 0, 1), color="0.88", lw=0)
    most = np.linalg.norm(arrows, axis=1).max()
    longest = 0.12 * np.ptp(at[..., 0])
    # Arrows end where tractions act
    style = {"angles": "xy", "scale_units": "xy", "pivot": "tip", "color": COMPUTED}
    right.quiver(*feet.T, *arrows.T, scale=most / longest, width=0.004, **style)
    right.update_datalim(feet - longest / most * arrows)
    right.autoscale_view()
    right.set_title(f"contact tractions, at most {most:.3g}", loc="left")
    for one in (left, right):
        one.set_aspect("equal")
        one.axis("off")
        if line is not None:
            one.plot(*line, color=EXACT, lw=1.2)
    fig.savefig(path)


def field_and_curve(path, u, f, *parts, **options):
    """Picture of a deformed plane body with a field, and a curve beside its closed form.

    The rest is as of `polygons_and_curve`. Collective.
    """
    x, moved, values = gather_cells(u.function_space.mesh, u, f)
    if u.function_space.mesh.comm.rank == 0:
        polygons_and_curve(path, x[..., :2] + moved, values, *parts, **options)


def polygons_and_curve(
    path, at, values, label, exact, computed, axes, zoom=None, sides=(1,)
):
    """Picture of polygons with values at their corners, and a curve.

    `exact` and `computed` are (x, y, name), `axes` what is set of the right axes, and
    `zoom` has the ends of both left ones. Sides -1 and 1 mirror a half.
    """
    fig, (left, right) = pyplot().subplots(
        1, 2, figsize=(11, 3.6), layout="constrained"
    )
    fig.get_layout_engine().set(wspace=0.08)
    colours = draw_field(left, at, values, [(side, 1) for side in sides])
    left.axis("off")
    if zoom is not None:
        left.set(xlim=zoom[:2], ylim=zoom[2:])
    fig.colorbar(colours, ax=left, label=label, shrink=0.8)
    beside(right, exact, computed, **axes)
    fig.savefig(path)


def states_and_curve(path, states, label, top, images, exact, computed, axes, box):
    """Picture of plane bodies at some states, one below the other, and of a curve.

    `states` are (title, cells with u and a field, any lines (x, y)), the rest is as of
    `polygons_and_curve`.
    """
    look = {"figsize": (11, 4.8), "layout": "constrained"}
    places = [[title, "curve"] for title, *_ in states]
    figure, panels = pyplot().subplot_mosaic(places, **look)
    figure.get_layout_engine().set(wspace=0.08)
    for title, (x, u, values), *lines in states:
        one = panels[title]
        for curve in lines:
            one.plot(*curve, color=EXACT, lw=1.0)
        colours = draw_field(one, x[..., :2] + u, values, images, top=top)
        one.set(xlim=box[:2], ylim=box[2:])
        one.set_title(title, loc="left")
        one.axis("off")
    bodies = [panels[title] for title, *_ in states]
    figure.colorbar(colours, ax=bodies, label=label, shrink=0.7)
    beside(panels["curve"], exact, computed, **axes)
    figure.savefig(path)


def side_by_side(axes, states, shares, width, top):
    """Draw plane bodies above a floor at shares of the time, side by side.

    `states` are those of `gather_states`. Returns the colours.
    """
    shown = [states[round(share * (len(states) - 1))] for share in shares]
    places = [width * k for k in range(len(shown))]
    for place, (_, (x, u, field)) in zip(places, shown):
        colours = draw_field(axes, x[..., :2] + u + [place, 0.0], field, top=top)
    axes.axhline(0.0, color=EXACT)
    times = [f"{time:.3g}" for time, _ in shown]
    axes.set(aspect="equal", xticks=places, xticklabels=times, xlabel="time")
    axes.set_ylabel("height")
    return colours


def beside(axes, exact, computed, size=5, **settings):
    """Draw a closed form and what is computed, each (x, y, name)."""
    axes.plot(*exact[:2], color=EXACT, label=exact[2])
    axes.plot(*computed[:2], "o", ms=size, color=COMPUTED, label=computed[2])
    axes.set(**{"ylim": (0, None), **settings})
    axes.legend()


def animate(path, frames, box, top, label="von Mises stress", line=0.0):
    """Write an animation, a GIF, of bodies above a line.

    Frames are (time, (x, field)) with corners (cells, k, 2) and values (cells, k, 1),
    `box` the ends of both axes, `top` the largest value of the colours.
    """
    from matplotlib.animation import FuncAnimation, PillowWriter
    from matplotlib.collections import PolyCollection

    figure, axes = pyplot().subplots(figsize=(4.8, 4.2))
    bodies = PolyCollection([], edgecolor="k", lw=0.2)
    bodies.set_clim(0.0, top)
    axes.add_collection(bodies)
    axes.set(aspect="equal", xlim=box[:2], ylim=box[2:])
    if line is not None:
        axes.axhline(line, color=EXACT)
    figure.colorbar(bodies, ax=axes, label=label, shrink=0.8)

    def show(k):
        time, (x, field) = frames[k]
        bodies.set_verts(x)
        bodies.set_array(field.mean(axis=(1, 2)))
        axes.set_title(f"time {time:.4g}")
        return [bodies]

    movie = FuncAnimation(figure, show, frames=len(frames))
    movie.save(path, writer=PillowWriter(fps=15), dpi=72)
