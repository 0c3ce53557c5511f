"""Warnings of contact, but for those of tension, of tilted and of few facets, and of
contact that is narrower than one.

All are right to be told in scenes of few facets; their tests are test_tension.py,
test_sharp_corners.py, test_few_facets.py and test_narrow_contact.py.
"""

from __future__ import annotations

import warnings

from raymortar import ContactWarning

COARSE = "|".join(
    (
        ".*tension of",
        ".*tilted against it",
        ".* carr(y|ies) the contact",
        ".*contact is narrower than a facet",
    )
)


def refuse_warnings():
    """Turn them into errors, within `warnings.catch_warnings`."""
    warnings.simplefilter("error", ContactWarning)
    warnings.filterwarnings("ignore", COARSE, ContactWarning)


def keep_warnings():
    """Record all of them, within `warnings.catch_warnings(record=True)`."""
    warnings.simplefilter("always", ContactWarning)
    warnings.filterwarnings("ignore", COARSE, ContactWarning)
