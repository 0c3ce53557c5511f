"""Newton's method for a problem.

- newton: `NewtonSolver`, `SNESSolver`
- solver: linear systems, checks and failures of both
- linear: PETSc options of the linear solver of a problem
- petsc_objects: PETSc options, and contexts that know the problem
"""
