"""Contact's share of PETSc matrices and vectors.

- coupled: what a problem asks of contact: matrices, vectors, iterates
- assembly: one contact's share; groups: its rows by kind
- volume: the user's forms
"""
