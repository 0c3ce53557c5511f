"""Pictures of deformed bodies and of the contact pressure.

- picture: `plot`
- drawing: pictures by matplotlib
- traction_curves, pressure_maps: tractions in 2D, and pressure in 3D, on the slaves
- slave_points: what these gather of all ranks
- outlines, wires: rigid tools in 2D and in 3D
- rendering: pictures in 3D by pyvista
"""
