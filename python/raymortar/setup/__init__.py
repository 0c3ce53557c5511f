"""Faults of a problem that are found before its first solve.

- revolution: facets and tools of solids of revolution
- adjustment: surfaces that should just touch
- volumes: its form: numbers gamma, solids of revolution
- shared_pairs, inertia: a problem that has been made: pairs of its contacts, forms
- memory: its matrix, against the memory that there is
- overlap, rigid_slaves, straight_facets: its undeformed meshes
"""
