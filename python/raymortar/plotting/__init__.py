"""Pictures of deformed bodies and of what they press with.

- picture: `plot`
- drawing: in the plane, with matplotlib
- outlines: rigid tools in the plane
- rendering: in space, with pyvista
"""
