"""Pictures of deformed bodies and of the contact pressure.

- picture: `plot`
- drawing: pictures by matplotlib
- traction_curves, pressure_maps: tractions in 2D, and pressure in 3D, on the slaves
- slave_points: what these gather of all ranks
- tools: curves on rigid tools
- rendering: pictures in 3D by pyvista
"""
