"""Contact in the user's own unknowns.

- condensed_problem: `CondensedProblem`
- condensation: elimination of dual multipliers
"""
