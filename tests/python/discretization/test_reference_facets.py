"""Reference facets: node order, shape functions, reflections."""

import numpy as np
import pytest

from raymortar import _cpp
from raymortar.core import compat
from raymortar.core.discretization.facets import (
    facet_nodes,
    reflection,
    shape_functions,
)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("shape", ["interval", "triangle", "quadrilateral"])
def test_facet_nodes_are_in_basix_order(shape, degree):
    basix_points = compat.basix_element(shape, degree).points
    assert np.allclose(facet_nodes(shape, degree), basix_points)


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("shape", ["interval", "triangle", "quadrilateral"])
def test_shape_functions_are_nodal_and_sum_to_one(shape, degree):
    nodes = facet_nodes(shape, degree)
    values, gradients = shape_functions(shape, degree, nodes)
    assert np.allclose(values, np.eye(len(nodes)))
    assert np.allclose(gradients.sum(axis=2), 0)
    slopes = np.einsum("iqa,ad->qdi", gradients, nodes)
    assert np.allclose(slopes, np.eye(nodes.shape[1]))


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("shape", ["interval", "triangle", "quadrilateral"])
def test_shape_functions_are_those_of_basix(shape, degree):
    """Of the C++ library, whose tables are its own, and of Python."""
    points, _ = compat.quadrature(shape, 5)
    basix_values, *basix_gradients = compat.tabulate(shape, degree, points)
    in_cpp = _cpp.shape_functions(getattr(_cpp.Shape, shape), degree, points)
    for values, gradients in (in_cpp, shape_functions(shape, degree, points)):
        assert values == pytest.approx(basix_values, abs=1e-14)
        assert gradients == pytest.approx(np.array(basix_gradients), abs=1e-13)


def test_reflections_are_those_of_the_contract():
    assert reflection("interval", 2).tolist() == [1, 0, 2]
    assert reflection("triangle", 2).tolist() == [0, 2, 1, 3, 5, 4]
    quad = reflection("quadrilateral", 2)
    assert quad.tolist() == [0, 2, 1, 3, 5, 4, 7, 6, 8]
