"""An offset that makes bodies overlap by more than there is of them is told."""

import warnings

import numpy as np
import pytest
from problems import COMM, SOLVERS, build, fix

from meshes.scenes import two_blocks
from raymortar import ContactWarning, ConvergenceError

HEIGHT = 0.25
pytestmark = pytest.mark.mpi


def case(offset=None, cell="triangle"):
    """A block 1 high, and another of a quarter on it."""
    dim = 2 if cell in ("triangle", "quadrilateral") else 3
    size = (1.0,) * (dim - 1) + (HEIGHT,)
    scene = two_blocks(COMM, dim, cell, 3, 4, upper_size=size)
    return build(
        scene,
        material="neo-hookean",
        bcs=lambda V, s: [fix(V, s, "bottom"), fix(V, s, "top")],
        offset=offset,
    )


def told(make):
    """Warnings of an interference, and what is made."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ContactWarning)
        made = make()
    texts = [str(w.message) for w in caught]
    return [text for text in texts if "makes an interference" in text], made


@pytest.mark.quick
def test_it_is_named_with_the_body_and_the_unit(cell):
    texts, made = told(lambda: case(-1.0, cell))
    excess = made.contact.offsets.excess
    assert len(texts) == 1 and texts[0].startswith(f"{excess} (docs")
    assert "the argument offset makes an interference of 1 on slave tag" in texts[0]
    assert f"more than the {HEIGHT} of body" in texts[0]
    assert "a length in the unit of the mesh" in texts[0]


@pytest.mark.parametrize("offset", [-0.2, 1.0, lambda x: -0.2 * np.cos(x[0])])
def test_less_than_the_thinner_body_is_not(offset):
    assert told(lambda: case(offset))[0] == []


def test_one_that_grows_is_told_once_and_forgotten_when_it_is_less():
    made = case()

    def grow():
        for t in (0.1, 0.5, 1.0):
            made.contact.set_offset(-t)

    texts, _ = told(grow)
    assert len(texts) == 1 and "interference of 0.5" in texts[0]
    assert "interference of 1 " in made.contact.offsets.excess
    made.contact.set_offset(-0.1)
    assert made.contact.offsets.excess is None


def test_a_failure_names_it_and_no_search_distance():
    _, made = told(lambda: case(-3.0))
    with pytest.raises(ConvergenceError) as failure:
        made.solve(SOLVERS[-1])
    text = str(failure.value)
    assert "the argument offset makes an interference of 3" in text
    assert text.endswith("Try a smaller interference") or "(rank" in text
    assert "reach in Search" not in text
