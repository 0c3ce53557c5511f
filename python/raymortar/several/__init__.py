"""Several contacts in one problem.

- interactions: `Interactions`, as which a problem sees a list of contacts, and checks of it
- system: their common rows
"""
