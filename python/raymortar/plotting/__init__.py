"""Pictures of deformed bodies and of the contact pressure.

- picture: `plot`
- drawing: pictures by matplotlib
- outlines, wires: rigid tools in 2D and in 3D
- rendering: pictures in 3D by pyvista
"""
