"""Run time against error of contact that ends somewhere, beside GetFEM.

    scripts/python benchmarks/accuracy/edges.py                   # a quarter of an hour
    scripts/python benchmarks/accuracy/edges.py --scenes punch wedge
    scripts/python benchmarks/accuracy/edges.py --plot            # of the CSV that is there

Writes `results/edges.csv` and a picture of each scene to docs/pictures. Seconds are
processor time of the load steps; `wall` is beside it. On each mesh all laws and programs
run in turn, and what takes less than two seconds three times: medians.
"""

import argparse
import csv
import statistics
import sys
import time
from functools import partial
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE), str(ROOT / "tests" / "helpers"), str(ROOT / "demos")]
sys.path.append(str(ROOT / "benchmarks"))

import logging  # noqa: E402
import warnings  # noqa: E402

import drawing  # noqa: E402
import edge_friction  # noqa: E402
import edge_scenes as scenes  # noqa: E402
import getfem_peer  # noqa: E402

FIELDS = (
    *("scene", "program", "law", "role", "degree", "n", "unknowns"),
    *("iterations", "error", "seconds", "wall", "repeats"),
)
LAWS = tuple(scenes.METHODS)
# Longer ones run once
SHORT, REPEATS = 2.0, 3
# Foundation's cells along in the mesh whose reactions stand for the exact ones
FINEST = 160


def pressed(make, n, degree, law, role):
    """A case in raymortar."""
    case = make(n, degree, role)
    with scenes.Watch() as watch:
        contact, error, iterations = scenes.solve_pressed(case, degree, law)
    return contact.layout.size_global, iterations, error(), watch.seconds, watch.wall


def pressed_by_getfem(make, n, degree, law, role):
    """The same in GetFEM."""
    from edge_peer import Peer

    peer = Peer(make(n, degree, role), degree)
    iterations, seconds, wall = peer.solve()
    return peer.model.nbdof(), iterations, peer.error(), seconds, wall


def solved(solve, n, degree, law, role):
    """A scene that has its own program."""
    with scenes.Watch() as watch:
        contact, error, iterations = solve(n, degree, law)
    return contact.layout.size_global, iterations, error(), watch.seconds, watch.wall


class Ironing:
    """Reactions of shallow ironing against those of a finer mesh, found when wanted."""

    reference = None

    def exact(self):
        if self.reference is None:
            _, self.reference, _ = edge_friction.iron(FINEST, "points")
        return self.reference

    def ours(self, n, degree, law, role):
        solve = partial(edge_friction.solve_ironing, self.exact())
        return solved(solve, n, degree, law, role)

    def getfem(self, n, degree, law, role):
        sys.path.append(str(ROOT / "benchmarks" / "speed"))
        import ironing

        forces = []
        peer = ironing.Peer(n, n // 5)
        start = time.process_time(), time.perf_counter()
        iterations = 0
        for t in ironing.times(*edge_friction.IRONING):
            iterations += peer.step(t)
            forces.append(peer.force()[::-1])
        seconds = time.process_time() - start[0], time.perf_counter() - start[1]
        along = forces[edge_friction.IRONING[0] :]
        error = edge_friction.relative(along, self.exact())
        return peer.model.nbdof(), iterations, error, *seconds


IRON = Ironing()
HERTZ_2D, HERTZ_3D = (partial(scenes.hertz, dim) for dim in (2, 3))
ROLES = tuple(scenes.ROLES)
# By scene: what solves it with ours, in GetFEM, roles, sizes by degree
SCENES = {
    "hertz_2d": (
        partial(pressed, HERTZ_2D),
        partial(pressed_by_getfem, HERTZ_2D),
        ROLES,
        {1: (6, 12, 24), 2: (6, 12)},
    ),
    "punch": (
        partial(pressed, scenes.punch),
        partial(pressed_by_getfem, scenes.punch),
        ("",),
        {1: (4, 8, 16, 32, 64), 2: (4, 8, 16, 32)},
    ),
    "partial_slip": (
        partial(solved, edge_friction.solve_partial_slip),
        None,
        ("",),
        {1: (10, 20, 40), 2: (10, 20)},
    ),
    "wedge": (
        partial(solved, edge_friction.solve_wedge),
        None,
        ("",),
        {1: (2, 4, 8), 2: (2, 4, 8)},
    ),
    "ironing": (IRON.ours, IRON.getfem, ("",), {1: (20, 40, 80)}),
    "ball": (
        partial(solved, scenes.solve_ball_of_revolution),
        None,
        ("",),
        {1: (4, 8, 16, 32), 2: (4, 8, 16)},
    ),
    "ball_3d": (
        partial(pressed, scenes.ball_in_space),
        None,
        ("",),
        {1: (2, 3, 4, 6), 2: (2, 3)},
    ),
    "hertz_3d": (
        partial(pressed, HERTZ_3D),
        partial(pressed_by_getfem, HERTZ_3D),
        ROLES,
        {1: (4, 6, 8)},
    ),
}


def runs(scene):
    """Groups of runs on one mesh: (settings, what solves)."""
    ours, theirs, roles, sizes = SCENES[scene]
    for role in roles:
        for degree, ns in sizes.items():
            for n in ns:
                same = {"scene": scene, "role": role, "degree": degree, "n": n}
                group = [({"program": "raymortar", "law": law}, ours) for law in LAWS]
                if theirs and getfem_peer.gf:
                    group.append(({"program": "GetFEM", "law": "points"}, theirs))
                yield [(same | own, solve) for own, solve in group]


def measured(group):
    """Rows of runs on one mesh, which take turns."""
    found = {}
    for turn in range(REPEATS):
        for k, (settings, solve) in enumerate(group):
            done = found.setdefault(k, [])
            if turn and (not done or done[0][3] > SHORT):
                continue
            asked = {name: settings[name] for name in ("n", "degree", "law", "role")}
            try:
                done.append(solve(**asked))
            except (RuntimeError, TypeError) as error:
                # A program that finds no solution has no row
                print(f"{settings} failed: {str(error)[:200]}", flush=True)
    for k, done in found.items():
        if done:
            unknowns, iterations, error, *_ = done[0]
            seconds, wall = (statistics.median(one[i] for one in done) for i in (3, 4))
            yield group[k][0] | {
                "unknowns": unknowns,
                "iterations": iterations,
                "error": f"{error:.4g}",
                "seconds": f"{seconds:.4g}",
                "wall": f"{wall:.4g}",
                "repeats": len(done),
            }


def rows_of(path):
    """Rows that are there."""
    if not path.exists():
        return []
    with path.open(newline="") as lines:
        return list(csv.DictReader(lines))


def solve_all(path, names):
    """Measure scenes; the rows of others stay."""
    found = [row for row in rows_of(path) if row["scene"] not in names]
    for name in names:
        for group in runs(name):
            for row in measured(group):
                found.append(row)
                print(*(row[field] for field in FIELDS), flush=True)
            with path.open("w", newline="") as file:
                table = csv.DictWriter(file, FIELDS)
                table.writeheader()
                table.writerows(found)


# Title, and what the error is of
TITLES = {
    "hertz_2d": ("Elastic cylinder on an elastic block", "pressure in L2"),
    "hertz_3d": ("Elastic ball on an elastic block", "pressure in L2"),
    "punch": ("Flat punch on a half plane", "pressure in L2"),
    "partial_slip": ("Cattaneo and Mindlin: partial slip", "tangential traction in L2"),
    "wedge": ("A block pushed up a wedge (CGS-4)", "push over weight"),
    "ironing": ("Shallow ironing", "reactions"),
    "ball": ("Rigid ball on a half-space", "pressure in L2"),
}
# Relative errors above are of another solution, and not drawn
MOST = 1.0
# Largest over smallest value of an axis that has labels between its decades
MOST_LABELLED = 300.0
LOOK = {"points": ("C0", "o"), "nodes": ("C1", "^"), "dual": ("C2", "s")}


def draw(found, folder):
    """A picture of each scene: error over seconds, on log scales."""
    plt = drawing.pyplot()
    for scene, (title, what) in TITLES.items():
        # The rigid ball in 3D has its own panel beside the solid of revolution
        parts = [scene] if scene != "ball" else ["ball", "ball_3d"]
        panels = [(s, role) for s in parts for role in SCENES[s][2]]
        width = 4.8 * len(panels) + 2.2
        figure, axes = plt.subplots(
            1, len(panels), figsize=(width, 4.0), sharey=True, squeeze=False
        )
        for ax, (part, role) in zip(axes[0], panels):
            rows = [r for r in found if r["scene"] == part and r["role"] == role]
            _curves(ax, rows)
            under = {"ball": "of revolution", "ball_3d": "a quarter in 3D"}.get(
                part, role
            )
            ax.set(title=under, xlabel="processor time (s)")
            ax.grid(True, which="both", alpha=0.2)
            if scene == "wedge":
                # Errors are of the model, and alike
                ax.set_ylim(1e-6, 1e-3)
            _label_ticks(ax)
        axes[0, 0].set(ylabel=f"relative error of the {what}")
        axes[0, -1].legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))
        figure.suptitle(title)
        figure.tight_layout()
        figure.savefig(folder / f"edges_{scene}.png", dpi=100)
        plt.close(figure)


def _label_ticks(ax):
    """Label 1, 2 and 5 of each decade where there are few."""
    from matplotlib.ticker import LogLocator, NullFormatter

    for axis, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        if high < MOST_LABELLED * low:
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())


def _curves(ax, rows):
    kinds = dict.fromkeys((r["program"], r["law"], r["degree"]) for r in rows)
    for program, law, degree in kinds:
        own = [
            (float(r["seconds"]), float(r["error"]))
            for r in rows
            if (r["program"], r["law"], r["degree"]) == (program, law, degree)
            and float(r["error"]) < MOST
        ]
        colour, marker = LOOK[law] if program == "raymortar" else ("0.3", "x")
        style = {"color": colour, "marker": marker, "ms": 5, "lw": 1.2}
        style["ls"], style["mfc"] = (
            ("--", "none") if int(degree) == 1 else ("-", colour)
        )
        name = f"law at {law}" if law != "dual" else "dual multipliers"
        label = f"{program if program == 'GetFEM' else name}, degree {degree}"
        ax.loglog(*zip(*own), label=label, **style)


def main(arguments=None):
    """Measure and draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--plot", action="store_true", help="do not solve")
    parser.add_argument("--output", type=Path, default=HERE / "results")
    parser.add_argument("--pictures", type=Path, default=ROOT / "docs" / "pictures")
    args = parser.parse_args(arguments)
    # What a coarse mesh is warned of, and compilers of forms
    warnings.simplefilter("ignore")
    logging.disable(logging.WARNING)
    path = args.output / "edges.csv"
    if not args.plot:
        if getfem_peer.gf is None:
            print(getfem_peer.MISSING)
        solve_all(path, args.scenes)
    draw(rows_of(path), args.pictures)
    return 0


if __name__ == "__main__":
    sys.exit(main())
