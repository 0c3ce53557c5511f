"""Contact's share of PETSc matrices and vectors.

- coupled: what a problem asks of contact
- assembly: one contact's share; groups: its rows by kind
- volume: the user's forms
- iterates: differences of iterates, by groups
- entries: entries of PETSc's matrices
"""
