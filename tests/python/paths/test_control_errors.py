"""Controls that cannot lead: what is said, and which options are refused."""

import sys
import warnings
from pathlib import Path

import pytest
from snapping import on_bed

from raymortar import ContactError, ContactWarning, LoadSteps
from raymortar.core import compat
from raymortar.paths import ArcLength, DisplacementControl

sys.path.append(str(Path(__file__).parents[3] / "demos"))


# Wrong arguments


@pytest.mark.mpi
@pytest.mark.parametrize(
    "make, message",
    [
        (lambda p: 3, "control must be a DisplacementControl"),
        (lambda p: DisplacementControl(p.top, 1), "must be a length"),
        (lambda p: DisplacementControl(p.top, by=1.0), "direction must be"),
        (lambda p: DisplacementControl(p.top, 5, by=1.0), "none of 2 components"),
        (lambda p: DisplacementControl(p.top, (1.0,), by=1.0), "must have 2 entries"),
        (lambda p: DisplacementControl("top", 1, by=1.0), "where must be"),
        (lambda p: DisplacementControl(p.top[:0], 1, by=1.0), "names no dof"),
        (lambda p: DisplacementControl(p.top + 10**6, 1, by=1.0), "has not"),
        (lambda p: ArcLength(radius=0.0), "must be a positive length"),
        (lambda p: ArcLength(psi=-1.0), "not negative"),
        (lambda p: ArcLength(most=0), "most = 0"),
        (lambda p: ArcLength(falling=2), "falling must be"),
    ],
)
def test_controls_that_are_none_are_refused(make, message):
    problem = on_bed("triangle")
    with pytest.raises(ContactError, match=message):
        LoadSteps(problem.solver, problem.apply, control=make(problem))


@pytest.mark.mpi
def test_numbers_of_facets_are_told_from_dofs():
    """Both are whole numbers; of facets on the boundary some are dofs inside."""
    problem = on_bed("triangle")
    mesh = problem.u.function_space.mesh
    facets = compat.exterior_facets(mesh)
    for where, tells in ((facets, True), (problem.top, False)):
        control = DisplacementControl(where, 1, by=-0.1)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ContactWarning)
            try:
                LoadSteps(problem.solver, problem.apply, control=control)
            except ContactError as error:  # more facets than dofs
                assert tells and "has not" in str(error)
                continue
        assert any("belong to facets" in str(w.message) for w in caught) == tells


@pytest.mark.mpi
def test_control_excludes_what_it_cannot_be_with():
    problem = on_bed("triangle")
    control, arguments = ArcLength(), (problem.solver, problem.apply)
    with pytest.raises(ContactError, match="exclude each other"):
        LoadSteps(*arguments, control=control, stabilize=True)
    with pytest.raises(ContactError, match="two ends"):
        LoadSteps(*arguments, control=control, path=(1.0, 1.0))
