"""What tests of pictures share."""

import pytest
from problems import COMM

import raymortar


@pytest.fixture
def draw(folder):
    """Solve a problem, and give the axes of its bodies; None but on rank 0."""

    def drawn(found):
        raymortar.SNESSolver(found.problem).solve()
        file = folder / "tool.png"
        figure = raymortar.plot(found.contact, file)
        if COMM.rank > 0:
            return None
        assert file.stat().st_size > 0
        return figure.axes[0]

    return drawn
