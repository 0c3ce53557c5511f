"""Warnings of contact, but for those of tension and of tilted facets.

Both are right to be told in scenes of few facets; their tests are test_tension.py and
test_sharp_corners.py.
"""

from __future__ import annotations

import warnings

from raymortar import ContactWarning

COARSE = "converged with tension|the facets of slave"


def refuse_warnings():
    """Turn them into errors, within `warnings.catch_warnings`."""
    warnings.simplefilter("error", ContactWarning)
    warnings.filterwarnings("ignore", COARSE, ContactWarning)


def keep_warnings():
    """Record all of them, within `warnings.catch_warnings(record=True)`."""
    warnings.simplefilter("always", ContactWarning)
    warnings.filterwarnings("ignore", COARSE, ContactWarning)
