"""The coefficient gamma of bodies that bend, whose surfaces yield far more than facets.

- compliance: how far surfaces yield
- coefficients: the coefficient of a law at nodes
"""
