"""Meshes, spaces, dofs, tagged facets and forms of DOLFINx, as contact needs them.

- unknowns: the unknowns: a displacement alone or beside others
- joined: several meshes as one
- facets, tagged: tagged facets, turned outward
- layout: the numbering of all unknowns
- surfaces: facets as the C++ code takes them
- forms: forms of a problem, and what it solves for
- slave_fields: fields on slave facets, from numbers, Functions or callables
- ranks: what ranks exchange: boxes, marks at dofs
"""
