"""Every difference between DOLFINx 0.5, 0.9 and 0.11 (and Basix, UFL, petsc4py).

Nothing else in raymortar asks for a version. Where two generations differ by a name
or a type, the code asks for the feature rather than for the number.

Vectors are handled as *ghosted arrays*: the unrolled dofs of a space on this rank,
owned ones first, then ghosts, shape ``((owned + ghosts) * block size,)``.
"""

from .forms import *
from .generation import *
from .meshes import *
