"""Pictures of deformed bodies and of the contact pressure.

- picture: `plot`
- drawing: bodies, and in 3D the pressure on the slaves, by matplotlib
- traction_curves: tractions along the slaves in 2D
- slave_points: what these gather of all ranks
- tools: curves on rigid tools
- rendering: pictures in 3D by pyvista
"""
