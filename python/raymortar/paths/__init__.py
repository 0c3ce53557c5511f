"""Paths of load steps: sizes, ways, control, history, files.

- load_steps: `LoadSteps`, the one loop over steps
- load_path, led_paths: paths that the load factor, a displacement or an arc leads,
  behind one interface; controls: what a user chooses to lead a path
- strategies: ways that are tried before a step is halved
- prediction: starts of steps, and the way that goes first
- soft_stick: first tangents in which fronts of slip and of opening run
- soft_start: the plain solver, smaller coefficients and shorter steps
- stabilization: viscous forces that fade
- energy_balance: balance that tells a path of equilibria from a jump
- history, patch_columns, output: records of a path
- checkpoint, tables: files from which a path goes on
"""

from typing import TYPE_CHECKING

from ..core import on_demand

if TYPE_CHECKING:
    from .controls import ArcLength, DisplacementControl
    from .output import LoadStep, Output

__all__ = ["ArcLength", "DisplacementControl", "Output"]

_PLACES = {
    "ArcLength": ".controls",
    "DisplacementControl": ".controls",
    "LoadStep": ".output",
    "Output": ".output",
}

__getattr__ = on_demand.lookup(__name__, _PLACES, {})
