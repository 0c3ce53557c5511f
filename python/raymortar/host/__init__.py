"""What DOLFINx's side gives: meshes, spaces, dofs, tagged facets, forms.

- host: the unknowns: a displacement alone or beside others
- joined: several meshes as one
- facets, tagged: tagged facets, turned outward
- layout: the numbering of all unknowns
- slave_fields: fields on slave facets, from numbers, Functions or callables
- extents: boxes around points of all ranks
"""
