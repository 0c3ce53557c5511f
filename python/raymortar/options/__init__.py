"""Choices of the user: method, friction law, search, quadrature.

- methods: `AugmentedLagrangian`, `Penalty`, `Search`, friction laws, and all arguments of
  a `Contact`
- user_laws: laws that are functions of the user's
"""
