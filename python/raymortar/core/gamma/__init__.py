"""The coefficient gamma of the augmented Lagrangian and of the penalty.

- probing: moduli and Poisson's ratios, from products with the volume's matrix
- stiffness: the stiffness of the cells behind each facet
"""
