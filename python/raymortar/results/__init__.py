"""Results of a contact: points, fields, forces, counts, segments.

- points: arrays over points; nodal_fields: averages of them at nodes
- tractions: what acts at points, and where on the bodies
- looking: points that are found once for all who look at a state
- sums, communication: forces, energies and counts summed over points and ranks
- segments: files of segments and points
"""

from ..core.interface.pairs import Pair
from ..core.interface.point_results import Status

__all__ = ["Pair", "Status"]
