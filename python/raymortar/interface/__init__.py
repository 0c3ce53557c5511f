"""One slave and its masters: the C++ zones and their input.

- contact_surfaces, zones: from tagged facets to C++ zones; zone_data: what they hold
- probing, stiffness, coefficients: moduli and gamma, read off the volume's matrix
- cover, held: slave nodes that are covered, shared or prescribed
- present, state, accepted: the present state, and the one that a step starts from
- point_results, point_places: statuses, and values at points from nodes and back
- pairs: names of pairs
"""
