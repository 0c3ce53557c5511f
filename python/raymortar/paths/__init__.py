"""Paths of load steps: sizes, ways, control.

- load_steps: `LoadSteps`, the one loop over steps
- load_path, led_paths: paths that the load factor, a displacement or an arc leads,
  behind one interface; controls: what a user chooses to lead a path
- strategies: the order of the ways that are tried before a step is halved; strategy: the
  protocol of a way; as_given, ways: the ways
- prediction: starts of steps, and the way that goes first
- soft_stick: first tangents in which fronts of slip and of opening run
- soft_start: the plain solver, smaller coefficients and shorter steps
- energy_balance: balance that tells a path of equilibria from a jump
- memory: how a path has gone so far, for checkpoints
"""

from typing import TYPE_CHECKING

from ..core import on_demand

if TYPE_CHECKING:
    from ..records.output import LoadStep, Output
    from .controls import ArcLength, DisplacementControl

__all__ = ["ArcLength", "DisplacementControl", "Output"]

_PLACES = {
    "ArcLength": ".controls",
    "DisplacementControl": ".controls",
    "LoadStep": "..records.output",
    "Output": "..records.output",
}

__getattr__ = on_demand.lookup(__name__, _PLACES, {})
