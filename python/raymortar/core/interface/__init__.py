"""One slave and its masters: the C++ zones and their input.

- contact_surfaces, zones: from tagged facets to C++ zones; zone_data: what they hold
- slave_nodes: slave nodes that are covered, shared or prescribed
- coefficients: pairs of bodies that meet, and the coefficient of each
- unfelt: multipliers that no free row feels
- present: the present state, and the one that a step starts from
- offsets: clearance and interference
- point_results: statuses, and values at points from nodes and back
- pairs: names of pairs
"""
