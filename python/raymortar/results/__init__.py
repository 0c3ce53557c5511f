"""What a user reads off a contact: fields, forces, counts, segments.

- fields: the results of `Contact`
- segments, vtu: files of segments and points
"""
