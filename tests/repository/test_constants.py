"""Constants that were chosen: each module says why its numbers are as they are."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "python" / "raymortar"


def is_number(value):
    """Whether an expression is made of numbers, not of texts or calls."""
    parts = list(ast.walk(value))
    leaves = [part.value for part in parts if isinstance(part, ast.Constant)]
    calls = any(isinstance(part, ast.Call) for part in parts)
    return bool(leaves) and all(type(n) in (int, float) for n in leaves) and not calls


def numbers(text):
    """Lines of assignments to constants of a module, numbers or tuples of numbers."""
    for node in ast.parse(text).body:
        if not isinstance(node, ast.Assign):
            continue
        names = [n.id for n in ast.walk(node.targets[0]) if isinstance(n, ast.Name)]
        value = node.value
        values = value.elts if isinstance(value, ast.Tuple) else [value]
        is_constant = all(name.strip("_").isupper() for name in names)
        if names and is_constant and any(map(is_number, values)):
            yield node.lineno


def has_reason(lines, at):
    """Whether a comment is on a line, by number, or above its block of lines."""
    if "#" in lines[at - 1]:
        return True
    above = at - 2
    while above >= 0 and lines[above].strip() and lines[above].lstrip()[0] != "#":
        above -= 1
    return above >= 0 and lines[above].lstrip().startswith("#")


def without_reason(text):
    """Lines of constants that no comment explains."""
    lines = text.split("\n")
    return [at for at in numbers(text) if not has_reason(lines, at)]


def test_each_number_has_its_reason():
    texts = {p: p.read_text(encoding="utf-8") for p in sorted(PACKAGE.rglob("*.py"))}
    assert sum(len(list(numbers(text))) for text in texts.values()) > 100
    bare = [
        f"{p.name}:{at}" for p, text in texts.items() for at in without_reason(text)
    ]
    assert bare == []


@pytest.mark.parametrize(
    "text, lines",
    [
        ("A = 3\n", [1]),
        ("# Why\nA = 3\nB, C = 0.5, 1e-9\n", []),
        ("# Why\nA = 3\n\nB = 4\n", [4]),
        ("A = 3  # why\nNAME = 'a'\nIS = True\n", []),
        ("A = -0.5 * 3.0\n", [1]),
    ],
)
def test_numbers_without_a_reason_are_found(text, lines):
    assert without_reason(text) == lines
