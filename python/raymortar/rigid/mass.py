"""Inertia tensors of rigid bodies."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..checked import is_real_number
from ..compat import Array
from ..errors import ContactError

# Share of the largest moment by which a tensor may miss what it must be
ROUNDING = 1e-9


def inertia_tensor(given: Any) -> Array:
    """Inertia tensor (3, 3) from a number, three moments or a tensor.

    Raises
    ------
    ContactError
        Unless it is symmetric and positive definite, with moments that a body can have.
    """
    fault = f"inertia = {given!r} must be a number, three moments or a tensor (3, 3)"
    if is_real_number(given):
        given = [float(given)] * 3
    try:
        tensor = np.array(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise ContactError(fault) from None
    if tensor.shape == (3,):
        tensor = np.diag(tensor)
    if tensor.shape != (3, 3) or not np.all(np.isfinite(tensor)):
        raise ContactError(fault)
    most = float(np.abs(tensor).max())
    if np.abs(tensor - tensor.T).max() > ROUNDING * most:
        raise ContactError(f"inertia = {given!r} must be symmetric")
    a, b, c = np.linalg.eigvalsh(tensor)
    if a <= 0.0 or c > (a + b) * (1.0 + ROUNDING):
        raise ContactError(
            f"no body has the principal moments of inertia {a:.6g}, {b:.6g}, {c:.6g}: "
            "each is above 0, and none above the sum of the others"
        )
    return 0.5 * (tensor + tensor.T)
