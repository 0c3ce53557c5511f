"""Models of demos with the options that tests and benchmarks vary.

They share materials, supports and reports with the demos. Two are programs of long
paths, with published curves, interruption and restart:

    PYTHONPATH=benchmarks scripts/python -m models.shallow_ironing --fine
    PYTHONPATH=benchmarks scripts/python -m models.half_ring --checkpoint ring.npz
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / "demos"))
