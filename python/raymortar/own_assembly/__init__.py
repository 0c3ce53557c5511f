"""Contact in a user's own assembly.

- assembly: `OwnAssembly`, which `Contact`'s methods of matrices and vectors call
- checks: of what a user hands to them
"""
