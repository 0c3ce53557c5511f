"""Fields that cross contact surfaces, and wear.

- flux, flux_law, flux_sides: `Flux`, its laws, and fields on both sides
- flux_terms, flux_part, tool_part: fluxes as terms of a problem, also to rigid tools
- field_tie, field_problem: `FieldTie`; `FieldProblem`, of fields alone
- wear, anderson: `Wear`, and the iteration for its implicit steps
"""
