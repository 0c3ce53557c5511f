"""What is in written files, and what has to be."""

import xml.etree.ElementTree as ElementTree

import numpy as np
from problems import COMM


def arrays(path):
    """Data arrays of a VTK file by name."""
    found = {}
    for element in ElementTree.parse(path).iter("DataArray"):
        values = np.array((element.text or "").split(), dtype=float)
        n = int(element.get("NumberOfComponents"))
        found[element.get("Name")] = values.reshape(-1, n) if n > 1 else values
    return found


def at_nodes(function):
    """Values of all ranks by position, rounded; vectors filled up to three."""
    V = function.function_space
    x = np.round(V.tabulate_dof_coordinates(), 9) + 0.0
    values = function.x.array.reshape(len(x), -1)
    found = {}
    for part in COMM.allgather(dict(zip(map(tuple, x), values.tolist()))):
        found |= part
    return found
