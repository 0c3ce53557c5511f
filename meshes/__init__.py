"""Meshes of the demos, benchmarks and tests; users bring their own from Gmsh."""
