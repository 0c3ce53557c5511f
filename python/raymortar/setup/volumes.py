"""Numbers gamma and solids of revolution that do not fit the form of the bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.errors import ContactError, is_real_number, warn
from ..core.system.coupled import CoupledSystem

# Largest ratio of gamma to the stiffness, and of a penalty the inverse of the least:
# beyond, one of the two is lost in the rounding errors of the other
FROM_STIFFNESS = 1e10
# Least ratio with a multiplier. Without friction 1e-100 solves as 1 does, and 1e-200 has
# errors of 1e-11, as squares of the unknowns overflow
LEAST_AUGMENTATION = 1e-100
# Ratios with a multiplier from which on Newton's method may fail: with friction it does
# at 1e-6 and 1e3, without at 1e4 to 1e8
DOUBTFUL = 1e-5, 1e3

# A force below this share of the stiffness is rounding error, if all radii grow by one
_NO_HOOPS = 1e6 * float(np.finfo(float).eps)


def check_coefficients(system: CoupledSystem, bcs: Sequence[Any]) -> None:
    """Raise for a number gamma that no solve can do with, warn of one with which
    Newton's method may fail. Collective."""
    for part in system.parts:
        tables = part.contact_stiffness(bcs)
        if tables is None or not is_real_number(part.gamma):
            continue
        stiffness = min(float(table.min()) for table in tables)
        ratio = part.gamma_scale / stiffness
        has_multiplier = part.surfaces.multiplier is not None
        least = LEAST_AUGMENTATION if has_multiplier else 1.0 / FROM_STIFFNESS
        text = (
            f"gamma = {part.gamma_scale:.3g} is {ratio:.1e} times the stiffness of the "
            f"bodies over the area of their facets, {stiffness:.3g} here: leave gamma out"
        )
        if not least < ratio < FROM_STIFFNESS:
            raise ContactError(text)
        is_usual = DOUBTFUL[0] <= ratio <= DOUBTFUL[1]
        if has_multiplier and not (part.surfaces.tied or is_usual):
            warn(f"{text}, as Newton's method may fail with it", page="contact")


def warn_of_plane_form(system: CoupledSystem, bcs: Sequence[Any]) -> None:
    """Warn if the form of a solid of revolution does not resist a growth of the radius,
    as hoops do. Collective."""
    if not system.axisymmetric:
        return
    # Forces when all radii grow by 1, and the stiffness, at this rank's dofs
    forces, diagonal = system.volume.translation[0], system.stiffness_diagonal
    sums = np.array([forces @ forces, diagonal @ diagonal])
    hoops, stiffness = np.sqrt(system.comm.allreduce(sums))
    if stiffness > 0.0 and hoops <= _NO_HOOPS * stiffness:
        warn(
            "axisymmetric=True, but the form resists no growth of the radius: it needs "
            "the hoop strain u_r / r and the weight 2 pi r in all of its integrals",
        )
