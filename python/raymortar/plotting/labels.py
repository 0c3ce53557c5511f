"""Units, axes and labels of pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.errors import ContactError, is_real_number
from ..core.interface.pairs import Pair

# Abscissas of drawn tractions
ABSCISSAS = ("x", "y", "arc", "angle")
# Quantities with a unit: lengths, stresses, the field that colours bodies
QUANTITIES = ("length", "stress", "field")
Units = tuple[str, str] | Mapping[str, tuple[str, float]]


@dataclass(frozen=True)
class AxisOptions:
    """Options of the axes, as `plot` documents them. Checked."""

    x: str | None = None
    centre: Sequence[float] | None = None
    units: Any = None
    axes: str = "xy"
    zoom: bool = False

    def __post_init__(self) -> None:
        x, centre = self.x, self.centre
        if x is not None and x not in ABSCISSAS:
            raise ContactError(f"x must be one of {ABSCISSAS} or None, not {x!r}")
        if centre is not None and x != "angle":
            raise ContactError('centre is that of angles: give x="angle" too')
        if centre is not None:
            if np.shape(centre) != (2,) or not np.isfinite(centre).all():
                raise ContactError(f"centre must be (x, y), not {centre!r}")
        object.__setattr__(self, "units", _checked_units(self.units))

    def factor(self, quantity: str) -> float:
        """Number by which values of a quantity are multiplied."""
        return self.units.get(quantity, ("", 1.0))[1]

    def label(self, quantity: str, name: str) -> str:
        """Name and unit of a quantity, for an axis; the unit once."""
        unit = self.units.get(quantity, ("", 1.0))[0]
        has_unit = name == unit or name.endswith((f"({unit})", f"[{unit}]"))
        return name if has_unit or not unit else f"{name} ({unit})"

    def length(self, name: str) -> str:
        """Label of a length."""
        return self.label("length", name)

    def stress(self, name: str) -> str:
        """Label of a stress."""
        return self.label("stress", name)


def _checked_units(units: Any) -> dict[str, tuple[str, float]]:
    """Unit and factor by quantity."""
    if units is None:
        return {}
    if isinstance(units, (tuple, list)) and len(units) == 2:
        units = {name: (unit, 1.0) for name, unit in zip(QUANTITIES, units)}
    if not isinstance(units, Mapping):
        raise ContactError(
            "units must be (length, stress) or units and factors by quantity, such as "
            f'{{"length": ("mm", 1e3)}}, not {units!r}'
        )
    found = {}
    for name, unit in units.items():
        is_pair = isinstance(unit, (tuple, list)) and len(unit) == 2
        text, factor = unit if is_pair else (None, None)
        positive = is_real_number(factor) and 0.0 < factor < np.inf
        if name not in QUANTITIES or not isinstance(text, str) or not positive:
            raise ContactError(
                f"units must be a text and a positive factor of each of {QUANTITIES}, "
                f"not {unit!r} of {name!r}"
            )
        found[name] = text, float(factor)
    return found


def pair_label(pair: Pair) -> str:
    """Name of a pair for a legend."""
    sides = (pair.slave_name, pair.slave), (pair.master_name, pair.master)
    if all(name is None for name, _ in sides):
        return str(pair)
    return " on ".join(str(tag if name is None else name) for name, tag in sides)
