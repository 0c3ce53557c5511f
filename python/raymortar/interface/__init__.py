"""One slave and its masters: the C++ zones, and what they are told.

- zones: from tagged facets to C++ zones
- coefficients, shear_modulus: the automatic gamma
- state: what a step starts from
- point_results: what is read off the integration points
- pairs: names of pairs
"""
