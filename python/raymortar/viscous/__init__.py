"""Viscous forces, which slow down bodies that nothing holds, and fade.

- viscosity: the term of the forces
- stabilization: the solves of one step, until it ends without them
- held_motions, approach: motions that nothing resists; a body that moves into contact
- budget: how long a way may go on without getting anywhere
"""
