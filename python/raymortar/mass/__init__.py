"""Inertia of bodies, whose contact surfaces have no mass.

- inertia: `Inertia`, and the matrices of its forms
- nodal_forms: its forms, and damping, without nodes that have no mass
- massless: these nodes, and where their mass goes

Users import it from `dynamics`.
"""
