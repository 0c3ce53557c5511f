"""Contact's share of PETSc matrices and vectors.

- coupled: what a problem asks of contact
- assembly: one contact's share
- memory: whether the matrix fits
"""
