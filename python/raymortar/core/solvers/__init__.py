"""Newton's method for a problem.

- newton: `NewtonSolver`, `SNESSolver`
- convergence_test: the end of a solve by SNES
- solver: linear systems, checks and failures of both
- petsc_objects: PETSc options, errors in what PETSc calls, and factors
"""
