"""Fields that cross contact surfaces; names of `wear`, too.

- flux, flux_law, flux_sides: `Flux`, its laws, and fields on both sides
- flux_terms, flux_part, tool_part: fluxes as terms of a problem, also to rigid tools
- field_tie, field_problem: `FieldTie`; `FieldProblem`, of fields alone
"""

from typing import TYPE_CHECKING

from ..core import on_demand

if TYPE_CHECKING:
    from ..wear.archard import Archard
    from ..wear.wear import Wear
    from .field_problem import FieldProblem
    from .field_tie import FieldTie
    from .flux import Flux
    from .tool_part import ToolField

__all__ = ["Archard", "FieldProblem", "FieldTie", "Flux", "ToolField", "Wear"]

_PLACES = {
    "Archard": "..wear.archard",
    "FieldProblem": ".field_problem",
    "FieldTie": ".field_tie",
    "Flux": ".flux",
    "ToolField": ".tool_part",
    "Wear": "..wear.wear",
}

__getattr__ = on_demand.lookup(__name__, _PLACES, {})
