"""Friction in solved problems: limits, fields and resultants, input errors."""

from __future__ import annotations

import gathered
import numpy as np
import pytest
import states
from dolfinx import fem
from problems import CELLS_2D, COMM, worst
from sheared_blocks import (
    HEIGHT,
    HOLDING,
    METHODS,
    OPEN,
    SHEAR,
    SLIP,
    STICK,
    WIDTH,
    Blocks,
    direction,
    limit_of,
    nominal,
    pressure,
    up,
)

from meshes.scenes import two_blocks
from raymortar import (
    AugmentedLagrangian,
    Contact,
    ContactError,
    Coulomb,
    Penalty,
    Stick,
    Tresca,
)
from raymortar.core import compat

# Friction patch (A7)


@pytest.mark.mpi
@pytest.mark.quick
@pytest.mark.parametrize("mu", [0.25, 0.5, 1.0])
@pytest.mark.parametrize("method", METHODS)
def test_force_ratio_is_mu_once_it_slips(cell, method, mu, record_property):
    blocks = Blocks(cell, METHODS[method](), Coulomb(mu))
    blocks.press()
    k = limit_of(Coulomb(mu), blocks.dim)
    for slide in (0.02, 0.05, 0.1):
        error = blocks.step(k, slide + blocks.spring(k))
        assert blocks.statuses() == {SLIP}
        record_property("ratio", abs(blocks.ratio() / mu - 1.0))
        record_property("displacement", error)
        assert abs(blocks.ratio() / mu - 1.0) <= 1e-9
        assert error <= 1e-9
        blocks.contact.advance()


@pytest.mark.mpi(where=lambda cell, **_: cell in ("quadrilateral", "tetrahedron"))
@pytest.mark.parametrize("method", HOLDING)
def test_tresca_plateau_is_the_bound(cell, method):
    bound = 0.2
    blocks = Blocks(cell, METHODS[method](), Tresca(bound))
    blocks.press()
    k = limit_of(Tresca(bound), blocks.dim)
    area = WIDTH ** (blocks.dim - 1)
    for slide in (0.02, 0.05):
        blocks.step(k, slide + blocks.spring(k))
        assert blocks.statuses() == {SLIP}
        force = np.linalg.norm(blocks.contact.resultant().tangential)
        assert abs(force / (bound * area) - 1.0) <= 1e-9
        blocks.contact.advance()
        # Results are those of the accepted step until the next update
        assert blocks.statuses() == {SLIP}
        after = np.linalg.norm(blocks.contact.resultant().tangential)
        assert after == force


@pytest.mark.mpi(where=lambda cell, **_: cell in ("triangle", "hexahedron"))
@pytest.mark.parametrize("method", HOLDING)
def test_stick_has_no_plateau(cell, method):
    """Ten times what Coulomb friction would hold, without slip."""
    blocks = Blocks(cell, METHODS[method](), Stick())
    blocks.press()
    for k in (0.05, 0.1, 0.2):
        assert blocks.step(k, blocks.spring(k)) <= 1e-9
        assert blocks.statuses() == {STICK}
        force = blocks.contact.resultant().tangential
        area = WIDTH ** (blocks.dim - 1)
        assert worst(force + SHEAR * k * area * direction(blocks.dim)) <= 1e-9
        blocks.contact.advance()


@pytest.mark.mpi(where=lambda cell, share, **_: share > 0.9 and cell in CELLS_2D)
@pytest.mark.parametrize("share", [0.5, 0.99, 1.01])
@pytest.mark.parametrize("method", HOLDING)
def test_uniform_shear_slips_above_the_limit_only(cell, method, share):
    """A traction on all of the upper block's faces cannot pass mu p: with the top
    held, the excess of the imposed shear goes into slip."""
    mu = 0.5
    blocks = Blocks(cell, METHODS[method](), Coulomb(mu))
    blocks.press()
    limit = limit_of(Coulomb(mu), blocks.dim)
    k = min(share, 1.0) * limit
    excess = max(share - 1.0, 0.0) * limit * HEIGHT
    assert blocks.step(k, excess + blocks.spring(k)) <= 1e-9
    assert blocks.statuses() == {SLIP if share > 1.0 else STICK}


@pytest.mark.mpi
@pytest.mark.parametrize("degree", [1, 2])
def test_stick_passes_a_uniform_shear_between_deformable_blocks(cell, degree):
    """A3 with friction: homogeneous simple shear through both, no slip."""
    blocks = Blocks(cell, AugmentedLagrangian(), Coulomb(1.0), degree, fixed=False)
    blocks.press()
    k = 0.1
    assert SHEAR * k < -pressure(blocks.dim)
    assert blocks.step(k) <= 1e-8
    assert blocks.statuses() == {STICK}
    p = blocks.contact.points()
    t = nominal(blocks.dim, k)[:, -1]
    assert worst(p["slip"]) <= 1e-9
    assert worst(p["traction"] + t) <= 1e-8 * np.linalg.norm(t)


# Fields and resultants


def slave_values(blocks, f):
    """Values of a field at its nodes on the slave surface."""
    V = f.function_space
    dofs = np.concatenate([z.result_table.ravel() for z in blocks.contact.zones])
    size = V.dofmap.index_map_bs
    return f.x.array.reshape(-1, size)[np.unique(dofs)]


@pytest.mark.mpi
@pytest.mark.parametrize("method", HOLDING)
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_fields_of_a_uniform_state(cell, method, share):
    blocks = Blocks(cell, METHODS[method](), Coulomb(0.5))
    blocks.press()
    k = share * limit_of(Coulomb(0.5), blocks.dim)
    slide = 0.03 if share == 1.0 else 0.0
    blocks.step(k, slide + blocks.spring(k))
    contact, e, z = blocks.contact, direction(blocks.dim), up(blocks.dim)
    # On the slave, whose outward normal is -z
    normal, tangential = -pressure(blocks.dim) * z, -SHEAR * k * e
    for part, value in (
        ("normal", normal),
        ("tangential", tangential),
        ("total", normal + tangential),
    ):
        assert worst(slave_values(blocks, contact.traction(part)) - value) <= 1e-9
    slip = (slide + blocks.spring(k)) * e
    assert worst(slave_values(blocks, contact.slip()) - slip) <= 1e-9
    assert worst(slave_values(blocks, contact.status()) - (3 if slide else 2)) == 0.0
    result, area = contact.resultant(), WIDTH ** (blocks.dim - 1)
    assert worst(result.normal - area * normal) <= 1e-9
    assert worst(result.tangential - area * tangential) <= 1e-9
    assert worst(result.force - result.normal - result.tangential) <= 1e-14


@pytest.mark.mpi
def test_open_contact_has_the_status_of_it(cell):
    blocks = Blocks(cell, AugmentedLagrangian(10.0), Coulomb(0.5))
    u = blocks.exact(0.0)
    u[states.upper_dofs(blocks.scene, blocks.problem.u.function_space), -1] += 0.1
    blocks.problem.u.x.array[:] = u.ravel()
    blocks.contact.update()
    assert blocks.statuses() == {OPEN}
    assert worst(slave_values(blocks, blocks.contact.status()) - OPEN) == 0.0
    assert worst(blocks.contact.traction("tangential").x.array) == 0.0


@pytest.mark.mpi
def test_resultant_splits_on_curved_surfaces(cell):
    case = states.Case(cell, 2, 2, "vector", "current")
    scene = case.scene("overhang")
    contact = states.make_contact(scene, case)
    states.set_state(contact, scene, "mixed", 1)
    p, result = gathered.points(contact), contact.resultant()
    n = p["contact_normal"]
    t_n = np.einsum("qi,qi->q", p["traction"], n)
    normal = (p["weight"] * t_n) @ n
    assert np.abs(result.normal - normal).max() <= 1e-13
    assert np.abs(result.force - result.normal - result.tangential).max() <= 1e-14
    assert np.linalg.norm(result.tangential) > 1e-3


@pytest.mark.mpi
@pytest.mark.parametrize("method", ["normal", "penalty"])
def test_resultant_without_friction_is_normal(cell, method):
    case = states.Case(cell, 2, 2, method)
    scene = case.scene("overhang")
    contact = states.make_contact(scene, case)
    states.set_state(contact, scene, "active", 1)
    result = contact.resultant()
    size = np.linalg.norm(result.force)
    assert size > 0.0
    assert np.abs(result.tangential).max() <= 1e-14 * size


# Input errors


@pytest.mark.mpi
@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf, "0.3", None, [0.3], 1j])
@pytest.mark.parametrize("law", [Coulomb, Tresca])
def test_impossible_coefficients_are_refused(small, law, value):
    with pytest.raises(ContactError, match="mu|bound"):
        make(small, friction=law(value))


@pytest.fixture(scope="module")
def small():
    scene = two_blocks(COMM, 2, "triangle")
    return scene, fem.Function(compat.vector_space(scene.mesh, 1))


def make(small, **options):
    scene, u = small
    pair = (scene.tags["slave"], scene.tags["master"])
    return Contact(u, scene.facet_tags, [pair], **options)


@pytest.mark.mpi
@pytest.mark.parametrize("friction", [0.3, "coulomb", Coulomb, True])
def test_friction_of_another_type_is_refused(small, friction):
    with pytest.raises(ContactError, match="friction must be"):
        make(small, friction=friction)


@pytest.mark.mpi
def test_friction_needs_a_vector_multiplier(small):
    method = AugmentedLagrangian(1.0, multiplier="normal")
    with pytest.raises(ContactError, match="vector"):
        make(small, method=method, friction=Coulomb(0.3))
    method = AugmentedLagrangian(1.0)
    assert make(small, method=method, friction=Coulomb(0.3)).layout.components == 2


@pytest.mark.mpi
def test_unknown_tangential_penalty_is_refused(small):
    with pytest.raises(ContactError, match="tangential"):
        make(small, method=Penalty(1.0, tangential="viscous"))


@pytest.mark.mpi
def test_slip_before_the_first_pairing_is_refused(small):
    with pytest.raises(ContactError, match="no results yet"):
        make(small, method=Penalty(1.0)).slip()


@pytest.mark.mpi
def test_unknown_part_of_traction_is_refused(small):
    contact = make(small, method=Penalty(1.0))
    contact.update()
    with pytest.raises(ContactError, match="part"):
        contact.traction(part="shear")
