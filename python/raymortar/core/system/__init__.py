"""Contact's share of PETSc matrices and vectors.

- coupled: what a problem asks of contact, and whether the matrix fits into memory
- assembly: one contact's share
- volume, kept_forms: the user's forms, and what is kept of linear ones
- fluxes, flux_part, tool_part: fluxes and ties of fields
"""
