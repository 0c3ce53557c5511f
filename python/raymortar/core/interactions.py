"""The former place of `Interactions`, from where it is still found."""

from . import on_demand

__getattr__ = on_demand.lookup(
    __name__, {}, {"Interactions": "raymortar.several.interactions.Interactions"}
)
