"""Meshes, spaces, dofs, tagged facets and forms of DOLFINx, as contact needs them.

- unknowns: the unknowns: a displacement alone or beside others
- joined: several meshes as one
- facets, tagged: tagged facets, turned outward
- layout: the numbering of all unknowns
- surfaces, checks: facets as the C++ code takes them, and facets that it refuses
- forms, thickness: forms of both sides, thickness of bodies
- slave_fields: fields on slave facets, from numbers, Functions or callables
- ranks: what ranks exchange: boxes, marks at dofs
"""
