"""Choices of the user: method, friction law, search, quadrature.

- methods: `AugmentedLagrangian`, `Penalty`, `Search`, and all arguments of a `Contact`
- friction: `Coulomb`, `Tresca`, `Stick`
- quadrature: rules on segments and facets
"""
