"""Records of a path: what it writes down, and files from which it goes on.

- history, patch_columns, rows: figures of every accepted step
- output: fields of every accepted step, and the line of progress
- checkpoint, settings, tables, facet_tables: files from which a path goes on
"""
