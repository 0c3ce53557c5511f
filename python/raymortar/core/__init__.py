"""The core: contact between bodies, a problem, and Newton's method, which stand alone.

It imports nothing of the package but itself and the compiled part. Floors beside it, such
as ``results`` or ``paths``, extend it by terms, targets and hooks. In the order in which
to read it:

- contact, interaction: `Contact`, and its base
- options: choices of the user
- discretization: meshes, tagged facets and unknowns of DOLFINx
- interface: one slave and its masters; gamma: coefficients from the volume's matrix
- target: masters, facets or others
- system: rows and matrices of contact; terms: the protocol of what else has any
- problem, nonlinear_problem: residual and tangent of forms and contact
- states, state: the accepted step, as named arrays; interactions: a former place
- solvers: Newton's method; convergence: its end
- hooks: where floors are told; finding, errors: what is said
- compat: differences between versions of DOLFINx
"""
