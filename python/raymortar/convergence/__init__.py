"""The end of a solve: when an iterate is a solution, and messages where none is found.

- convergence: the test of forces
- balance, patches: groups of rows that are judged separately
- lost_contact, passed_tools, loose, penetration: faults of a state that has converged
- failure, trouble: what residuals show, and messages
"""
