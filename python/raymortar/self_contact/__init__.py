"""Surfaces that meet themselves, and contact of all facets with each other.

- all_facets: exterior facets by tag and body
- never_meet: facets around sharp edges, which do not
"""
