"""The end of a solve, judged from arrays: when is an iterate a solution?

- convergence: the test of forces
- balance: groups of rows that are judged separately
"""
