"""The end of a solve, judged from arrays: when is an iterate a solution?

- convergence: the test of forces, and signs that a solve will not converge
- balance: groups of rows that are judged separately
"""
