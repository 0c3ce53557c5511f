"""Faults of a problem that are found before its first solve.

- arguments: of a contact: sides of pairs, meshes and displacements
- facets, shared_vertices: tagged facets, and the sides of pairs
- forms: of a problem: unknowns, numbers gamma, solids of revolution
- revolution: facets and tools of solids of revolution
- adjustment: surfaces that should just touch
- problems: a problem that has been made: pairs of its contacts, forms
- thickness, interference: bodies behind facets, against what is to be pressed away
- memory: its matrix, against the memory that there is
- rigid_loads, held_slaves: positions of rigid bodies, slaves that are prescribed
- overlap, rigid_slaves, straight_facets: its undeformed meshes
"""
