"""Fields on the slave that cannot be: what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx import fem
from problems import COMM, worst
from slave_functions import function_of

from meshes.scenes import two_blocks
from raymortar import Contact, ContactError, Coulomb, Tresca
from raymortar.core import compat

# Input errors


@pytest.fixture(scope="module")
def small():
    return two_blocks(COMM, 2, "triangle")


def make(small, **options):
    u = fem.Function(compat.vector_space(small.mesh, 1))
    pair = (small.tags["slave"], small.tags["master"])
    return Contact(u, small.facet_tags, [pair], **options)


FAULTS = {
    "text": (lambda mesh: "0.1", "must be a finite number, a Function or a callable"),
    "list": (lambda mesh: [0.1], "must be a finite number, a Function or a callable"),
    "nan": (lambda mesh: np.nan, "must be a finite number"),
    "nan somewhere": (
        lambda mesh: lambda x: np.where(x[0] > 0.4, np.nan, 0.1),
        "is nan on slave tag",
    ),
    "infinite": (
        lambda mesh: function_of(mesh, lambda x: np.full(x.shape[1], np.inf), 1),
        "is (inf|nan) on slave tag",
    ),
    "shape": (lambda mesh: lambda x: x, r"shape \(3, .* must be real, of shape"),
    "one": (lambda mesh: lambda x: 0.1, r"shape \(\) for points of shape \(3, "),
    "complex": (lambda mesh: lambda x: 1j * x[0], "must be real"),
    "vector": (
        lambda mesh: fem.Function(compat.vector_space(mesh, 1)),
        "must be a scalar Function",
    ),
    "mesh": (
        lambda mesh: fem.Function(
            compat.scalar_space(two_blocks(COMM, 2, "triangle").mesh, 1)
        ),
        "is a Function on another mesh",
    ),
}


@pytest.mark.mpi
@pytest.mark.parametrize("fault", FAULTS)
def test_impossible_fields_are_refused(small, fault):
    value, pattern = FAULTS[fault]
    with pytest.raises(ContactError, match=f"offset.*{pattern}"):
        make(small, offset=value(small.mesh))
    with pytest.raises(ContactError, match=f"mu.*{pattern}"):
        make(small, friction=Coulomb(value(small.mesh)))
    with pytest.raises(ContactError, match=f"bound.*{pattern}"):
        make(small, friction=Tresca(value(small.mesh)))
    contact = make(small, offset=0.5)
    with pytest.raises(ContactError, match=f"offset.*{pattern}"):
        contact.set_offset(value(small.mesh))
    assert contact.offset == 0.5
    assert worst(contact.zones[0].offset - 0.5) == 0.0


@pytest.mark.mpi
def test_negative_friction_is_refused(small):
    negative = fem.Function(compat.scalar_space(small.mesh, 1))
    negative.x.array[:] = -0.1
    for law, name in ((Coulomb, "mu"), (Tresca, "bound")):
        with pytest.raises(ContactError, match=f"{name} is -0.1 .* not be negative"):
            make(small, friction=law(negative))


@pytest.mark.mpi
def test_offset_that_differs_between_ranks_is_refused(small):
    if COMM.size == 1:
        assert make(small, offset=0.0).offset == 0.0
        return
    with pytest.raises(ContactError, match="offset differs between ranks"):
        make(small, offset=0.1 * COMM.rank)
