"""Newton's method for a problem.

- newton: `NewtonSolver`, `SNESSolver`
- solver: linear systems, checks and failures of both
- petsc_objects: PETSc options, errors in what PETSc calls, and factors
"""
