"""Descriptions of options, for what `repr` shows."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

from dolfinx.fem import Function


def shown(value: Any) -> str:
    """Describe an option as a user would write it, without what is default."""
    if is_dataclass(value):
        changed = [
            f"{field.name}={shown(getattr(value, field.name))}"
            for field in fields(value)
            if getattr(value, field.name) is not field.default
        ]
        return f"{type(value).__name__}({', '.join(changed)})"
    if isinstance(value, Function):
        return f"Function {value.name!r}"
    if callable(value):
        return str(getattr(value, "__name__", type(value).__name__))
    return f"{value:.6g}" if isinstance(value, float) else repr(value)
