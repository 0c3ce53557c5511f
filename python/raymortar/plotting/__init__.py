"""Pictures of deformed bodies and of the contact pressure.

- picture: `plot`
- drawing: by matplotlib, fields, surfaces, pressures, and tractions along slaves in 2D
- tools: curves on rigid tools
- rendering: pictures in 3D by pyvista
"""
