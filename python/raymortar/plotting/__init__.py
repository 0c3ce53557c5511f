"""Pictures of deformed bodies and of the contact pressure.

- picture: `plot`
- movie: `Movie`
- labels: units, axes and names
- frames: data of a picture, gathered on rank 0
- drawing: by matplotlib, fields, surfaces, pressures, and tractions along slaves in 2D
- pieces: polygons in space as pieces of one size
- tools: curves on rigid tools
- rendering: pictures in 3D by pyvista
"""
