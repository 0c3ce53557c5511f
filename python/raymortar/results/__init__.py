"""What a user reads off a contact: fields, forces, counts, segments.

- fields: averages at nodes
- points, sums: arrays over points, and forces, energies and counts summed over them
- segments: files of segments and points
"""
