"""Quadrature rules on segments and on whole slave facets."""

from __future__ import annotations

import numpy as np

from .. import _cpp, compat


def default_degree(shape: str, p: int, q: int, axisymmetric: bool = False) -> int:
    """Degree of the rule on segments, from where more points change no error.

    On simplices traction times test function is exact on flat facets: displacement of
    degree p times a multiplier of degree q (penalty: the gap, of degree p). On
    quadrilaterals a constant traction times a test function is, on flat parallelograms
    (without parallel sides shape functions are rational, and no rule is exact): 2p and
    1 for the Jacobian. The rule of degree 4 has no more points than that of 3.

    Parameters
    ----------
    shape
        Of the facets: ``"interval"``, ``"triangle"`` or ``"quadrilateral"``.
    p, q
        Degrees of displacement and multiplier.
    axisymmetric
        Whether the circumference, of degree 1, is a factor.
    """
    degree = max(2 * p + 1, 4) if shape == "quadrilateral" else p + q
    return degree + axisymmetric


def segment_rules(shape: str, degree: int, share: float = 1.0) -> _cpp.SegmentRules:
    """Rules for the segments of facets of a shape.

    Polynomials of the degree are integrated exactly on any segment. On one with four
    vertices the Jacobian of its bilinear map takes one degree more, and three points
    each way are the least: with two, Newton's method may go to and fro between points
    of large segments that open and close. Integrals count by their share: where both
    sides are integrated over, each counts half [theory (3.15)].
    """
    if shape == "interval":
        return _cpp.SegmentRules(facet_rule("interval", degree, share))
    triangle = facet_rule("triangle", degree, share)
    fan = _along_rays(share) if degree == 3 else triangle
    quadrilateral = facet_rule("quadrilateral", max(degree + 1, 5), share)
    return _cpp.SegmentRules(triangle, quadrilateral, fan)


def facet_rule(shape: str, degree: int, share: float = 1.0) -> _cpp.QuadratureRule:
    """Rule for whole facets, with a share of its weights."""
    points, weights = compat.quadrature(shape, degree)
    return _cpp.QuadratureRule(points, share * weights)


def _along_rays(share: float) -> _cpp.QuadratureRule:
    """Product of Gauss rules along and across the rays from a triangle's first corner.

    Four points for degree 3, where rules that favour no corner take six; at other
    degrees they have no more points than products. Around a centre nothing else is
    asked for than symmetry of each triangle about its own.
    """
    r = np.array([6 - np.sqrt(6), 6 + np.sqrt(6)]) / 10  # Gauss points for r dr
    by_r = np.array([9 - np.sqrt(6), 9 + np.sqrt(6)]) / 36
    t, by_t = np.array([3 - np.sqrt(3), 3 + np.sqrt(3)]) / 6, 1 / 2
    points = np.stack([np.outer(r, 1 - t).ravel(), np.outer(r, t).ravel()], axis=1)
    return _cpp.QuadratureRule(points, share * np.repeat(by_r * by_t, 2))
