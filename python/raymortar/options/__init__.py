"""Choices of the user: method, friction law, search, quadrature.

- methods: `AugmentedLagrangian`, `Penalty`, `Search`
- friction: `Coulomb`, `Tresca`, `Stick`, `Friction`
- quadrature: rules on segments and facets
- contact_options: all arguments of a `Contact`, and their checks
"""
