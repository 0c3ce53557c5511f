"""Results of a contact: points, fields, forces, counts, segments.

- points: arrays over points, averages of them at nodes
- sums: forces, energies and counts summed over points
- segments: files of segments and points
"""
