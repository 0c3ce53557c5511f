"""Free rigid bodies that a solve has turned too far for friction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..rigid.motions import LARGEST_TURN

if TYPE_CHECKING:
    from ..interaction import Interaction


def turned_too_far(contact: Interaction) -> str | None:
    """Message on a free body that friction acts on and that has turned too far in this
    step, else None. Collective.

    After half a turn the slip, which is a vector from a place to a place, points
    backwards, and friction would drive the body. Where a position is prescribed, it is
    refused before the solve; that of a free body is known after it.
    """
    for one in contact.contacts:
        if one.friction is None:
            continue
        bodies = dict.fromkeys(b for zone in one.zones for b in zone.facets.bodies)
        for body in filter(lambda body: body.is_free, bodies):
            angle = float(np.linalg.norm(body.freedom.theta))
            if angle >= LARGEST_TURN and one.resultant_on(body).force.any():
                return (
                    f"{body!r} has turned by {angle:.3g} rad in this step: with friction "
                    f"it has to be less than {LARGEST_TURN:.3g}. Take smaller steps"
                )
    return None
