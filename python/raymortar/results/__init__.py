"""Results of a contact: points, fields, forces, counts, segments.

- points: arrays over points; nodal_fields: averages of them at nodes
- tractions, levers: what acts at points, and where on the bodies
- sums, communication: forces, energies and counts summed over points and ranks
- segments: files of segments and points
"""

from ..core.interface.pairs import Pair
from ..core.interface.point_results import Status

__all__ = ["Pair", "Status"]
