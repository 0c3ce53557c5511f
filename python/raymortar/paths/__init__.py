"""Paths of load steps: sizes, strategies, control, history, files.

- load_steps: `LoadSteps`
- strategies: what is tried before a step is halved
- control, constraints, bordered: paths led by a displacement or an arc
- stabilization, viscosity: viscous forces that fade
- history, output, progress: what is written of a path
"""
