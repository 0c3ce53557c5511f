"""Published and computed reactions of shallow ironing, and how ours compare."""

import drawing
import numpy as np

# Coefficient of friction of the published problem
FRICTION = 0.3
# Peak to peak over the mean for t in [1.3, 1.7], less a quartic in time. It has the
# period of the elements, with and without friction (docs/measured/comparisons.md): 0.13
# and 0.8 % on the fine mesh (0.54 % with 500 steps), 0.04 and 0.4 % with elements half
# as large
RIPPLE_OF_V, RIPPLE_OF_H = 0.002, 0.01

# Reactions (V, H) by time. code_aster: SSNP153b, 2 steps down and 120 along
CODE_ASTER = {
    0.5: (93.863, None),
    1.0: (330.670, 63.646),
    1.1: (402.763, 126.993),
    1.2: (416.287, 127.587),
}
# GetFEM with our material laws, 10 steps down and 500 along
GETFEM = {
    "simo-miehe": {1.0: (330.49, 69.00), 1.5: (421.71, 129.93)},
    "neo-hookean": {1.0: (315.66, 66.60), 1.5: (402.19, 129.16)},
}
# The same without friction, 10 steps down and 100 along
GETFEM_FRICTIONLESS = {1.0: (324.85, 34.66), 1.5: (418.41, None)}
# Digitised in the solid-benchmarks collection of solids4foam
PUBLISHED_TIMES = (0.5, 0.8, 1.0, 1.1, 1.2, 1.3, 1.5, 1.7, 1.9)
PUBLISHED = {
    "code_aster, older method": (
        (96.2, 225.8, 332.0, 405.0, 416.4, 420.2, 421.0, 417.8, 393.9),
        (18.7, 46.5, 71.0, 138.8, 140.7, 141.8, 143.3, 141.3, 120.6),
    ),
    "Fischer & Wriggers 2006": (
        (86.1, 204.7, 297.9, 363.2, 368.8, 367.1, 365.1, 360.7, 342.4),
        (15.9, 39.9, 62.1, 172.6, 182.3, 189.7, 188.8, 191.0, 135.6),
    ),
    "Hartmann et al. 2009": (
        (95.1, 221.3, 319.5, 395.5, 406.5, 408.6, 408.4, 404.3, 379.3),
        (17.6, 44.0, 67.2, 149.6, 150.2, 162.4, 160.2, 156.9, 132.2),
    ),
    "Poulios & Renard 2015": (
        (81.5, 187.0, 267.9, 324.3, 334.0, 335.6, 337.4, 336.4, 321.9),
        (15.5, 37.4, 55.3, 99.4, 99.1, 100.9, 102.1, 101.4, 89.8),
    ),
    "Yastrebov 2011": (
        (92.3, 206.3, 289.7, 352.1, 366.1, 365.2, 359.5, 354.6, 334.7),
        (17.2, 41.0, 58.5, 167.4, 171.2, 173.2, 170.8, 165.3, 136.6),
    ),
}


def at(rows, t):
    """The row at time t, or None."""
    found = [row for row in rows if abs(row.t - t) < 1e-6]
    return found[0] if found else None


def ripple(rows, name, begin=1.3, end=1.7):
    """Peak to peak of V or H over the mean, after removing a quartic in time.

    None if the path does not get as far as `end`.
    """
    window = [row for row in rows if begin - 1e-6 <= row.t <= end + 1e-6]
    if rows[-1].t < end - 1e-6 or len(window) < 10:
        return None
    t = np.array([row.t for row in window]) - (begin + end) / 2
    y = np.array([getattr(row, name) for row in window])
    rest = y - np.polynomial.Polynomial.fit(t, y, 4)(t)
    return np.ptp(rest) / abs(y.mean())


def imbalance(rows):
    """Largest difference between contact force and reaction, over the largest force."""
    force = np.array([(row.H, row.V) for row in rows])
    contact = np.array([(-row.fx, row.fy) for row in rows])
    return np.abs(force - contact).max() / np.abs(force).max()


def compare(report, rows, reference, tolerances):
    """Rows of the report for a table of (V, H) by time."""
    for t, values in reference.items():
        row = at(rows, t)
        for name, value, tolerance in zip("VH", values, tolerances):
            if row is not None and value is not None:
                report.add(f"{name}({t})", getattr(row, name), value, tolerance, "N/mm")


def check(report, rows, fine, law, friction, press):
    """What the run must fulfil, by how much of it was run.

    Parameters
    ----------
    report, rows
        Where it is said, and the path.
    fine
        Whether the mesh is that of the references.
    law, friction, press
        Name of the material's law, coefficient of friction and number of steps down.
    """
    report.add("contact force / reaction", 1.0 + imbalance(rows), 1.0, 1e-7)
    # Away from the free ends: the foundation gives way there
    inner = [row for row in rows if 1.05 < row.t < 1.7 + 1e-6]
    if inner:
        last = inner[-1]
        # Friction acts on a curved surface that ploughs: H / V is close to mu
        allowed = 0.1 * FRICTION if friction else 0.005
        difference = last.H / last.V - friction
        report.add(f"1 + H / V - mu at {last.t:.4g}", 1.0 + difference, 1.0, allowed)
    if fine and law == "simo-miehe" and not friction:
        compare(report, rows, GETFEM_FRICTIONLESS, (0.005, 0.015))
    elif fine and friction == FRICTION and press > 2:
        compare(report, rows, GETFEM[law], (0.005, 0.015))
    elif fine and friction == FRICTION and law == "simo-miehe":
        compare(report, rows, CODE_ASTER, (0.005, 0.005))
    for name, allowed in (("V", RIPPLE_OF_V), ("H", RIPPLE_OF_H)):
        value = ripple(rows, name)
        if value is not None and (friction or name == "V"):
            bound = allowed if fine else None
            report.add(f"1 + ripple of {name}", 1.0 + value, 1.0, bound)


def draw(axes, rows, name, k):
    """One reaction over time: ours, code_aster's, and the curves of the literature."""
    markers = "sv^Do"
    for marker, (source, curves) in zip(markers, PUBLISHED.items()):
        axes.plot(
            PUBLISHED_TIMES, curves[k], marker + ":", color="0.6", ms=3.5, label=source
        )
    points = [(t, values[k]) for t, values in CODE_ASTER.items() if values[k]]
    axes.plot(
        *zip(*points), "x", color=drawing.EXACT, ms=7, label="code_aster, same method"
    )
    axes.plot(
        [0.0] + [row.t for row in rows],
        [0.0] + [getattr(row, name) for row in rows],
        color=drawing.COMPUTED,
        lw=1.8,
        label="raymortar",
    )
