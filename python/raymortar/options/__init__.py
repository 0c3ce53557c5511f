"""What a user chooses: method, friction law, search, quadrature.

- methods: `AugmentedLagrangian`, `Penalty`, `Search`
- friction: `Coulomb`, `Tresca`, `Stick`, `Friction`
- quadrature: rules on segments and facets
- arguments: checks of them all
"""
