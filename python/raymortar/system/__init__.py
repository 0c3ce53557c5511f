"""Contact's share of PETSc matrices and vectors.

- coupled: what a problem asks of contact
- assembly: one contact's share
- volume, split: the user's forms, and what of them is linear
- memory: whether the matrix fits
"""
