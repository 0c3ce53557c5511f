"""One slave and its masters: the C++ zones and their input.

- contact_surfaces, zones: from tagged facets to C++ zones; zone_data: what they hold
- probing, stiffness, surface_compliance, coefficients: moduli and gamma, from the
  volume's matrix
- slave_nodes: slave nodes that are covered, shared or prescribed
- present: the present state, and the one that a step starts from
- overlap, straight_facets: gaps at the start, and offsets
- friction_at_points: users' friction laws
- point_results: statuses, and values at points from nodes and back
- pairs: names of pairs
"""
