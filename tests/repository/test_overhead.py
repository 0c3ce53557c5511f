"""An iterate of a problem enters few Python functions of ours."""

import sys
from pathlib import Path

import pytest
from problems import COMM

if COMM.size > 1:
    pytest.skip("the benchmark is serial", allow_module_level=True)
sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks/overhead"))

import residual  # noqa: E402

pytestmark = pytest.mark.quick

# Functions of Python: more of them cost a small problem as much as its forms
MOST = 25


@pytest.mark.parametrize("name", ["2D, two blocks", "2D, free circle, friction"])
def test_residual_enters_few_functions(name):
    assert residual.measure(name, 2)["residual_frames"] <= MOST


def test_tangent_enters_few_functions():
    assert residual.measure("2D, two blocks", 2)["tangent_frames"] <= MOST + 3
