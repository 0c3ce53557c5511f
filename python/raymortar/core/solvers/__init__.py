"""Newton's method for a problem.

- newton: `NewtonSolver`, `SNESSolver`
- convergence_test: when a solve by SNES ends
- solver: linear systems, checks and failures of both
- petsc_objects: PETSc options, errors in what PETSc calls, and factors
"""
