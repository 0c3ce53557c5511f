"""Round bodies of straight facets.

- curving: arcs in place of straight facets
- straight_facets: how far straight facets are off
"""
