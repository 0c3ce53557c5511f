"""Straight facets on curved surfaces: told where they are a part of what is studied."""

import warnings

import numpy as np
import pytest
from problems import COMM, build, fix

from meshes.scenes import two_blocks
from raymortar import ContactWarning
from raymortar.setup.straight_facets import largest_sagitta

RADIUS, DIVISIONS = 2.0, 8


def arch(cell, gap, geometry_degree=1):
    """Two blocks, the interface a circle's arc in each plane across."""

    def height(x):
        return 1.0 - (RADIUS - np.sqrt(RADIUS**2 - (x[:, 0] - 0.5) ** 2))

    return two_blocks(
        COMM,
        2 if cell in ("triangle", "quadrilateral") else 3,
        cell,
        DIVISIONS,
        DIVISIONS,
        geometry_degree,
        gap=gap,
        interface=height,
    )


def told(scene, **options):
    case = build(scene, **options)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        case.contact.update()
    return [str(w.message) for w in caught if "straight facets" in str(w.message)], case


def test_sagitta_is_that_of_the_chord(cell):
    _, case = told(arch(cell, 0.0))
    found = largest_sagitta(case.contact.zones[0].facets.slave_surface, COMM)
    h = 1.0 / DIVISIONS
    assert found == pytest.approx(h**2 / (8 * RADIUS), rel=0.35)


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("node", range(1, DIVISIONS))
def test_sagittas_are_found_across_ranks_too(node):
    """At the one bend of a surface, wherever the mesh is divided."""
    slope, h = 0.1, 1.0 / DIVISIONS

    def height(x):
        return 1.0 + slope * np.maximum(x[:, 0] - node * h, 0.0)

    divisions = (DIVISIONS, 2)
    scene = two_blocks(COMM, 2, "quadrilateral", divisions, divisions, interface=height)
    found, case = told(scene)
    surface = case.contact.zones[0].facets.slave_surface
    chord = 0.5 * (h + h * np.hypot(1.0, slope))
    expected = np.arctan(slope) * chord / 8.0
    assert largest_sagitta(surface, COMM) == pytest.approx(expected, rel=1e-9)
    # And noted of surfaces that touch but for rounding, which say it when pressed
    assert found == []
    assert case.contact.zones[0].off_curve == pytest.approx(expected, rel=1e-9)


@pytest.mark.mpi
@pytest.mark.parametrize("gap", [0.002, -0.002])
@pytest.mark.parametrize("depth, is_wrong", [(0.0015, True), (0.05, False)])
def test_a_small_gap_or_overlap_is_told_if_bodies_are_pressed_by_little(
    cell_2d, gap, depth, is_wrong
):
    """The error of the gap is 10 % of how far bodies are pressed, or more."""
    down = np.array((0.0, -depth - max(gap, 0.0)))
    found, case = told(
        arch(cell_2d, gap),
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=down)],
    )
    assert found == []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        case.problem.solve()
    (one,) = (one for one in case.problem.check() if "straight facets" in one.text)
    assert one.is_wrong is is_wrong and "degree 2" in one.remedy
    texts = [str(w.message) for w in caught if "straight facets" in str(w.message)]
    assert texts == [f"{one} (docs/messages/warnings.md)"] * is_wrong


def test_an_interference_that_is_too_small_is_told_once(cell_2d):
    """Where the contact is made, and not in its solve again."""
    down = np.array((0.0, -0.0015))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        case = build(
            arch(cell_2d, 0.0),
            bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top", value=down)],
            offset=-0.001,
        )
        case.problem.solve()
    texts = [str(w.message) for w in caught if "straight facets" in str(w.message)]
    assert len(texts) == 1 and "with an interference of 1.000e-03" in texts[0]


@pytest.mark.mpi
@pytest.mark.parametrize("degree", (1, 2))
def test_arcs_in_their_place_are_not(cell, degree):
    assert told(arch(cell, 0.002), smooth=True, degree=degree)[0] == []


@pytest.mark.quick
@pytest.mark.mpi
@pytest.mark.parametrize("gap, tells", [(0.0, False), (-0.001, False), (-0.05, True)])
def test_chords_that_overlap_are_no_overlap_of_the_bodies(cell_2d, gap, tells):
    case = build(arch(cell_2d, gap), bcs=lambda V, s: [fix(V, s, ["bottom", "top"])])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        case.problem.create_matrix()
    assert any(" starts " in str(w.message) for w in caught) == tells


def noisy(noise):
    """Two blocks that overlap by the noise of their flat interface."""

    def height(x):
        return 1.0 + noise * np.sin(1e3 * x[:, 0])

    return two_blocks(COMM, 2, "quadrilateral", 8, 5, gap=-noise, interface=height)


@pytest.mark.mpi
def test_what_takes_noise_off_is_told():
    _, case = told(noisy(2e-3), bcs=lambda V, s: [fix(V, s, ["bottom", "top"])])
    changed = case.contact.adjust(within=0.01)
    assert changed.facets > 0 and changed.largest < 0.01
    case = build(noisy(2e-3), bcs=lambda V, s: [fix(V, s, ["bottom", "top"])])
    with pytest.warns(ContactWarning, match=r"straight facets .*adjust\(within="):
        case.problem.solve()


@pytest.mark.mpi
@pytest.mark.parametrize("gap", [0.02, -0.02])
def test_a_large_one_is_not(cell_2d, gap):
    assert told(arch(cell_2d, gap))[0] == []


def test_nor_are_curved_facets(cell_2d):
    assert told(arch(cell_2d, 0.002, geometry_degree=2))[0] == []


@pytest.mark.parametrize("gap", [0.0, 1e-9, -1e-9])
def test_nor_flat_surfaces(cell, gap):
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    assert told(two_blocks(COMM, dim, cell, gap=gap))[0] == []
