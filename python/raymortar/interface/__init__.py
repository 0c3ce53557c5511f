"""One slave and its masters: the C++ zones, and what they are told.

- contact_surfaces, zones: from tagged facets to C++ zones
- coefficients, shear_modulus: the automatic gamma
- state, accepted: what a step starts from
- point_results: what is read off the integration points
- pairs: names of pairs
"""
