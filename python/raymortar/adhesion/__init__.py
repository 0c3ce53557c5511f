"""Surfaces that adhere to each other until they have been torn apart.

- cohesive: `Cohesive`, the law at a point
- points: which points are bonded, and how far they are open
- bond: `Bond`, their forces, a term of a problem
"""
