"""Differences between versions of DOLFINx that floors meet, beside those of the core.

- spaces: mixed spaces and fields at quadrature points
- cells: numbers of cells, and values by cell
- arrays, gmsh: meshes out of arrays and out of Gmsh models

Names of `core.compat` are here, too.
"""

from ..core.compat import *
from .arrays import *
from .cells import *
from .spaces import *
