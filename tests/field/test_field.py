"""Other codes' own tests and public reports, solved here, lie where their sources say.

`docs/measured/other_codes.md` has the table of them.
"""

import pytest
from problems import COMM
from registry import all_cases

if COMM.size > 1:
    pytest.skip("values at nodes are those of one rank", allow_module_level=True)


@pytest.mark.parametrize("case", all_cases(), ids=lambda case: case.name)
def test_figures_are_those_of_the_source(case, record_property):
    outcome = case.solve()
    assert len(outcome.values) == len(case.figures)
    record_property("iterations", list(outcome.iterations))
    for figure, value in zip(case.figures, outcome.values):
        deviation = figure.deviation(value)
        record_property(figure.quantity, deviation)
        assert (
            abs(deviation) <= figure.tolerance
        ), f"{figure.quantity}: {value:.9g} for {figure.reference:.9g}"
