"""Functions of place for fields of the slave."""

import numpy as np
from dolfinx import fem

from raymortar.core import compat


def bumps(x):
    """An offset without symmetry, of both signs, smaller than the facets."""
    return 0.02 * np.sin(3.0 * x[0] + 0.3) - 0.03 * x[1] + 0.01


def function_of(mesh, values, degree=2):
    f = fem.Function(compat.scalar_space(mesh, degree))
    f.interpolate(values)
    return f
