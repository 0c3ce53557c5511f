"""Time series of load paths, read back: every step, every field, to the digit."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import hosts
import numpy as np
import pytest
from dolfinx import fem
from interacting import LOWER, ON_FIRST, ON_SECOND, UPPER, table, three
from load_paths import top_moves
from problems import COMM, tolerate
from written import arrays, at_nodes

from raymortar import ContactError, Coulomb, LoadSteps, Penalty, SNESSolver, Tie
from raymortar.core import compat
from raymortar.io import write_vtk
from raymortar.paths import Output

pytestmark = pytest.mark.mpi
FIELDS = {"gap", "normal_traction", "tangential_traction", "status", "coverage"}


def entries(path):
    """(time, part, path) of each file of a series."""
    COMM.barrier()
    sets = ElementTree.parse(path).iter("DataSet")
    return [
        (float(s.get("timestep")), int(s.get("part")), path.parent / s.get("file"))
        for s in sets
    ]


def pieces(path):
    """The .vtu files of a file of a series."""
    if path.suffix == ".vtu":
        return [path]
    return [
        path.parent / piece.get("Source")
        for piece in ElementTree.parse(path).iter("Piece")
    ]


def fields(path):
    """Values of a file by name and by place."""
    found = {}
    for piece in dict.fromkeys(pieces(path)):
        tree, data = ElementTree.parse(piece), {}
        for kind in ("Points", "PointData"):
            for array in tree.find(f".//{kind}").iter("DataArray"):
                width = int(array.get("NumberOfComponents") or 1)
                name = kind if kind == "Points" else array.get("Name")
                values = np.array(array.text.split(), dtype=float)
                data[name] = values.reshape(-1, max(width, 1))
        x = list(map(tuple, np.round(data.pop("Points"), 9) + 0.0))
        for name, values in data.items():
            if not name.startswith("vtk"):  # numbers and ghosts of the points
                found.setdefault(name, {}).update(zip(x, values.tolist()))
    return found


def assert_holds(read, exact, tolerance=1e-12):
    """A field that was read against one by place, of `at_nodes`."""
    assert len(read) == len(exact)
    size = max(np.abs(values).max() for values in exact.values())
    for x, values in read.items():
        n = len(exact[x])
        np.testing.assert_allclose(values[:n], exact[x], atol=tolerance * size)
        assert not np.any(values[n:])


def walked(steps, contact, u):
    """Times of a path, the displacement by place, and the contact's results."""
    return [
        (s.factor, at_nodes(u), at_nodes(contact.multiplier), contact.resultant())
        for s in steps
    ]


def assert_points_have(path, force):
    """Weights times tractions of a file of points are a force."""
    found = np.zeros(len(force))
    for piece in pieces(path):
        data = arrays(piece)
        traction = data["traction"].reshape(-1, 3)[:, : len(force)]
        found += data["weight"].ravel() @ traction
    np.testing.assert_allclose(found, force, rtol=1e-12, atol=1e-9)


@pytest.mark.quick
@pytest.mark.parametrize("cell", ["quadrilateral", "tetrahedron"])
def test_pvd_has_every_step_with_all_its_fields(cell, folder):
    path = folder / "run.pvd"
    problem, steps = top_moves(cell, steps=3, output=path)
    seen = walked(steps, problem.contact, problem.u)
    series = entries(path)
    assert [time for time, _, _ in series] == [step[0] for step in seen]
    assert len({file for _, _, file in series}) == 3
    for (_, _, file), (_, u, multiplier, _) in zip(series, seen):
        read = fields(file)
        assert set(read) == {problem.u.name, "multiplier", *FIELDS}
        assert_holds(read[problem.u.name], u)
        assert_holds(read["multiplier"], multiplier)
    for name in ("segments", "points"):
        beside = entries(folder / f"run_{name}.pvd")
        assert [time for time, _, _ in beside] == [step[0] for step in seen]
    for (_, _, file), (*_, resultant) in zip(beside, seen):
        assert_points_have(file, resultant.force)


@pytest.mark.quick
def test_xdmf_has_every_step_with_all_its_fields(folder):
    h5py = pytest.importorskip("h5py")
    path = folder / "run.xdmf"
    problem, steps = top_moves("triangle", steps=3, output=path)
    seen = walked(steps, problem.contact, problem.u)
    COMM.barrier()
    times = {float(t.get("Value")) for t in ElementTree.parse(path).iter("Time")}
    assert times == {step[0] for step in seen}
    with h5py.File(folder / "run.h5", "r") as file:
        assert set(file["Function"]) == {problem.u.name, "multiplier", *FIELDS}
        x = np.round(next(iter(file["Mesh"].values()))["geometry"][:], 9) + 0.0
        places = [(*row, *(0.0,) * (3 - len(row))) for row in x.tolist()]
        for (factor, u, multiplier, _), key in zip(
            seen, sorted(file["Function"]["multiplier"])
        ):
            assert float(key.replace("_", ".")) == pytest.approx(factor)
            for name, exact in ((problem.u.name, u), ("multiplier", multiplier)):
                values = file["Function"][name][key][:].tolist()
                assert_holds(dict(zip(places, values)), exact)
    assert len(entries(folder / "run_points.pvd")) == 3


def test_halved_steps_are_written_where_they_are_accepted(folder):
    problem, steps = top_moves("quadrilateral", steps=1, output=folder / "run.pvd")
    tolerate(problem.solver, max_it=3)
    factors = [step.factor for step in steps]
    assert steps.halvings > 0
    assert [time for time, _, _ in entries(folder / "run.pvd")] == factors


def test_slip_is_that_of_the_step(folder):
    """It is written before the step is accepted, after which it is zero."""
    blocks = table()
    contact = blocks.contact(ON_FIRST, ON_SECOND, friction=Coulomb(0.05))
    steps = blocks.path(contact, output=folder / "run.pvd")
    slips = []
    for _ in steps:
        slips.append(max(np.abs(v).max() for v in slip_of(entries(folder / "run.pvd"))))
    assert len(slips) == 3 and min(slips) > 1e-4


def slip_of(series):
    """Values of the slip in the last file of a series."""
    return list(fields(series[-1][2])["slip"].values())


# Calls one after the other


def test_next_call_of_the_writer_adds_to_the_series(folder):
    problem, _ = top_moves("triangle")
    mesh, u, path = problem.scene.mesh, problem.u, folder / "u.pvd"
    exact = []
    for k in range(12):
        u.x.array[:] = k + 1.0
        write_vtk(path, mesh, [u], 0.1 * k, append=k > 0)
        exact.append(at_nodes(u))
    series = entries(path)
    assert [time for time, _, _ in series] == [0.1 * k for k in range(12)]
    for (_, _, file), u_then in zip(series, exact):
        assert_holds(fields(file)[u.name], u_then)
    # One that is not there is begun; without asking, a series is begun anew
    write_vtk(folder / "v.pvd", mesh, [u], 3.0, append=True)
    write_vtk(path, mesh, [u], 4.0)
    assert [entries(folder / f)[0][0] for f in ("v.pvd", "u.pvd")] == [3.0, 4.0]
    assert len(entries(path)) == 1
    leftovers = {p.name for p in folder.glob("*.pvd*")}
    assert leftovers == {"u.pvd", "v.pvd"}


@pytest.mark.mpi
@pytest.mark.parametrize("ending", [".pvd", ".xdmf"])
def test_three_series_and_one_folder_are_beside_each_other(ending, folder):
    problem, steps = top_moves("triangle", steps=3, output=folder / f"run{ending}")
    steps.run()
    COMM.barrier()
    values = {".pvd": set(), ".xdmf": {"run.h5"}}[ending]
    series = {f"run{ending}", "run_segments.pvd", "run_points.pvd"}
    assert {p.name for p in folder.iterdir()} == {*series, *values, "run_files"}


def test_a_series_goes_on_in_another_path(folder):
    problem, steps = top_moves("triangle", steps=2)
    stored = fem.Function(compat.scalar_space(problem.scene.mesh, 1), name="stored")
    output = Output(problem.problem, folder / "run.pvd", [stored], segments=False)
    for path, count in (((0.0, 0.5), 1), ((0.5, 1.0), 2)):
        stored.x.array[:] = path[1]
        LoadSteps(problem.solver, steps.apply, count, path=path, output=output).run()
    series = entries(folder / "run.pvd")
    assert [time for time, _, _ in series] == [0.5, 0.75, 1.0] and output.steps == 3
    values = [{v[0] for v in fields(file)["stored"].values()} for _, _, file in series]
    assert values == [{0.5}, {1.0}, {1.0}]
    assert not list(folder.rglob("run_segments*"))
    # Another run takes the place of the series
    LoadSteps(problem.solver, steps.apply, 1, output=folder / "run.pvd").run()
    assert [time for time, _, _ in entries(folder / "run.pvd")] == [1.0]


# Several contacts, several meshes


def test_fields_of_several_contacts_are_told_apart(folder):
    blocks = three()
    contacts = [blocks.contact(LOWER), blocks.contact(UPPER, method=Penalty(200.0))]
    blocks.path(contacts, steps=1, output=folder / "run.pvd").run()
    ((_, _, file),) = entries(folder / "run.pvd")
    read = fields(file)
    assert set(read) == {"u", "multiplier_0"} | {
        f"{name}_{k}" for name in FIELDS for k in (0, 1)
    }
    for k, contact in enumerate(contacts):
        assert_holds(read[f"coverage_{k}"], at_nodes(contact.results.coverage()))
    assert [c.multiplier is None for c in contacts] == [False, True]
    assert contacts[0].multiplier.name == "multiplier"


KINDS = {
    "tie": {"kind": Tie, "partial": True},
    "no friction": {},
    "friction": {"friction": Coulomb(0.3)},
    "penalty": {"method": Penalty(200.0)},
    "penalty with friction": {"method": Penalty(200.0), "friction": Coulomb(0.3)},
}


@pytest.mark.parametrize("two", KINDS)
@pytest.mark.parametrize("one", KINDS)
def test_points_of_unlike_contacts_are_in_one_file(one, two, folder):
    """Slip is NaN at the points of a contact that has none."""
    blocks = three()
    contacts = [
        blocks.contact(LOWER, **KINDS[one]),
        blocks.contact(UPPER, **KINDS[two]),
    ]
    blocks.path(contacts, steps=1, output=folder / "run.pvd").run()
    ((_, _, file),) = entries(folder / "run_points.pvd")
    mine = pieces(file)[COMM.rank]
    read, points = arrays(mine), [contact.points() for contact in contacts]
    for name in ("traction", "slip"):
        none = [np.full_like(p["x"], np.nan) for p in points]
        expected = np.vstack([p.get(name, n) for p, n in zip(points, none)])
        if name in read or not np.all(np.isnan(expected)):
            np.testing.assert_array_equal(read[name][:, :2], expected)


@pytest.mark.parametrize("ending", [".pvd", ".xdmf"])
def test_bodies_on_meshes_of_their_own_are_all_there(ending, folder):
    found = hosts.apart(hosts.meshes(), degree=1)
    path = folder / f"run{ending}"
    LoadSteps(
        SNESSolver(found.problem),
        lambda t: found.push(0.0, -0.03 * t),
        steps=2,
        output=path,
    ).run()
    parts = [d.given for d in found.contact.unknowns.displacements]
    slave = found.contact.surfaces.slave_u
    if ending == ".xdmf":
        COMM.barrier()
        names = ["run.xdmf", "run_mesh1.xdmf"]
        texts = [(folder / name).read_text() for name in names]
        assert all(f'Name="{u.name}"' in text for u, text in zip(parts, texts))
        return
    series = entries(path)
    assert [(time, part) for time, part, _ in series] == [
        (0.5, 0),
        (0.5, 1),
        (1.0, 0),
        (1.0, 1),
    ]
    for (_, k, file), u in zip(series[2:], parts):
        read = fields(file)
        assert_holds(read[u.name], at_nodes(u))
        assert FIELDS.issubset(read) == (
            u.function_space.mesh is slave.function_space.mesh
        )


@pytest.mark.mpi
def test_further_fields_are_those_of_their_step(folder):
    problem, steps = top_moves("triangle")
    u = problem.contact.u
    twice = fem.Function(u.function_space, name="twice")

    def update():
        twice.x.array[:] = 2.0 * u.x.array

    path = folder / "run.pvd"
    output = Output(problem.problem, path, more=[twice], update=update)
    found = []
    for _ in LoadSteps(problem.solver, steps.apply, 2, output=output):
        np.testing.assert_array_equal(twice.x.array, 2.0 * u.x.array)
        found.append(at_nodes(twice))
    for (_, _, file), values in zip(entries(path), found):
        assert_holds(fields(file)["twice"], values)
    assert len(entries(path)) == 2


# Faults


def test_what_cannot_be_written_is_refused_at_once(folder):
    problem, steps = top_moves("triangle")
    other, _ = top_moves("triangle")
    refused = {
        "run.vtu must end in .pvd or .xdmf": folder / "run.vtu",
        "nowhere/run.pvd cannot be written": folder / "nowhere" / "run.pvd",
        "name of a file must be a path": 3,
        "output is of another problem": Output(other.problem, folder / "o.pvd"),
    }
    for said, output in refused.items():
        with pytest.raises(ContactError, match=said):
            LoadSteps(problem.solver, steps.apply, 1, output=output)
    for more in (3, [3], [other.u]):
        with pytest.raises(ContactError, match="^more "):
            Output(problem.problem, folder / "run.pvd", more)
    with pytest.raises(ContactError, match="update must be a function"):
        Output(problem.problem, folder / "run.pvd", update=3)
    with pytest.raises(ContactError, match="segments must be True or False"):
        Output(problem.problem, folder / "run.pvd", segments=3)
    with pytest.raises(ContactError, match="time of a step must be a number"):
        Output(problem.problem, folder / "run.pvd").write("now")


def test_a_broken_series_is_reported(folder):
    problem, _ = top_moves("triangle")
    path = folder / "run.pvd"
    if COMM.rank == 0:
        path.write_text("<VTKFile><Collection>")
    COMM.barrier()
    with pytest.raises(ContactError, match="run.pvd cannot be read"):
        write_vtk(path, problem.scene.mesh, [problem.u], append=True)
