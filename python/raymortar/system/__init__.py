"""Contact's share of PETSc matrices and vectors.

- coupled: what a problem asks of contact, and whether the matrix fits into memory
- assembly: one contact's share
- volume: the user's forms, and what of them is linear
- fluxes, flux_part, tool_part: fluxes and ties of fields
"""
