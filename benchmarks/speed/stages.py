"""CPU seconds of every stage of contact, and the floor of its insertion."""

from __future__ import annotations

import ctypes
import resource
import time
from pathlib import Path

from petsc4py import PETSc

import floor
import numpy as np
from grids import Pair

from raymortar import _cpp

STAGES = ("candidates", "segments", "rays")


def clock(call, repeats):
    """Median CPU seconds of a call."""
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        call()
        seconds.append(time.process_time() - start)
    return float(np.median(seconds))


def pairing(shape, degree, n, repeats, friction=False):
    """Stages of the pairing of a new zone, and its counts.

    Returns
    -------
    zone, dict
        Seconds: ``first`` (everything, halo included), the stages, ``again`` (moved by
        less than the skin), ``unmoved``.
    """
    first, stages = [], {name: [] for name in STAGES}
    for _ in range(repeats):
        pair = Pair(shape, degree, n, friction=friction)
        first.append(clock(pair.zone.pair, 1))
        counts = pair.zone.statistics()
        for name in STAGES:
            stages[name].append(counts[f"seconds_{name}"])
    shift = 1e-9 / n

    def again():
        nonlocal shift
        shift *= -1.1
        pair.move(shift)
        pair.zone.pair()

    result = {"first": float(np.median(first))}
    result |= {name: float(np.median(values)) for name, values in stages.items()}
    result["again"] = clock(again, repeats)
    assert pair.zone.statistics()["candidate_builds"] == 1
    result["unmoved"] = clock(pair.zone.pair, repeats)
    return pair, result, pair.zone.statistics()


def assembly(pair, repeats):
    """Seconds of residual, tangent and their parts.

    ``laws`` is what the residual computes; ``blocks`` what the tangent computes;
    ``insertion`` the rest of it; ``floor`` writing blocks of the same sizes to the same
    places with MatSetValues. Second result: memory of the process with the matrix.
    """
    zone, A = pair.zone, pair.matrix()
    b = PETSc.Vec().createSeq(pair.size)
    positions, counts = _cpp.BlockPositions(), _cpp.AssemblyStatistics()
    least = floor.load()
    _cpp.add_tangent(zone, A.handle, positions, counts)
    A.assemble()

    def tangent():
        A.zeroEntries()
        _cpp.add_tangent(zone, A.handle, positions, counts)
        A.assemble()

    def writing():
        A.zeroEntries()
        least.write_blocks(zone, A.handle)
        A.assemble()

    def residual():
        b.set(0.0)
        _cpp.add_residual(zone, b.handle, counts)
        b.assemble()

    result = {
        "laws": clock(lambda: least.compute_blocks(zone, False), repeats),
        "residual": clock(residual, repeats),
        "blocks": clock(lambda: least.compute_blocks(zone, True), repeats),
        "tangent": clock(tangent, repeats),
        "floor": clock(writing, repeats),
    }
    memory = resident()
    result["insertion"] = max(result["tangent"] - result["blocks"], 0.0)
    return result, memory


def resident():
    """Memory of this process, bytes. What is free goes back to the system before."""
    ctypes.CDLL(None).malloc_trim(0)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def row(shape, degree, n, repeats=5, friction=False):
    """One line of the table: counts, seconds and memory of one size.

    ``bytes`` are those of surfaces, zone and contact's own matrix.
    """
    before = resident()
    pair, seconds, counts = pairing(shape, degree, n, repeats, friction)
    assembled, memory = assembly(pair, repeats)
    seconds |= assembled
    line = {
        "shape": shape,
        "degree": degree,
        "contact": "friction" if friction else "frictionless",
        "facets": pair.facets,
        "pairs": counts["pairs"],
        "segments": counts["segments"],
        "points": counts["points"],
        "candidates_found": counts["candidates"],
        "bytes": memory - before,
    }
    return line | {f"s_{name}": value for name, value in seconds.items()}


def search(shape, n, strategy, repeats):
    """Median CPU seconds to find the candidates of new linear surfaces, and their number."""
    pair = Pair(shape, 1, n, strategy)
    seconds = []
    for _ in range(repeats):
        start = time.process_time()
        found = pair.candidates()
        seconds.append(time.process_time() - start)
    return float(np.median(seconds)), found
