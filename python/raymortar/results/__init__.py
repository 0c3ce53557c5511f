"""Results of a contact: points, fields, forces, counts, segments.

- points: arrays over points, averages of them at nodes
- sums: forces, energies and counts summed over points
- segments: files of segments and points
"""

from ..core.interface.pairs import Pair
from ..core.interface.point_results import Status

__all__ = ["Pair", "Status"]
