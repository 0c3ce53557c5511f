"""Pictures of deformed bodies and of what they press with.

- picture: `plot`
- drawing: in the plane, with matplotlib
- outlines, wires: rigid tools in the plane and in space
- rendering: in space, with pyvista
"""
