"""Warnings of contact, but for those of tension beside narrow contact.

Tension is right to be told in scenes of few facets; its tests are test_tension.py.
"""

from __future__ import annotations

import warnings

from raymortar import ContactWarning

TENSION = "converged with tension"


def refuse_warnings():
    """Turn them into errors, within `warnings.catch_warnings`."""
    warnings.simplefilter("error", ContactWarning)
    warnings.filterwarnings("ignore", TENSION, ContactWarning)


def keep_warnings():
    """Record all of them, within `warnings.catch_warnings(record=True)`."""
    warnings.simplefilter("always", ContactWarning)
    warnings.filterwarnings("ignore", TENSION, ContactWarning)
