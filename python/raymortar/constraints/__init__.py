"""Linear constraints between unknowns, in place of which a problem has their masters.

`reduction` has the equations, `prolongation` reads what a user gives, `multipliers` finds
those of nodes that have one displacement.
"""
