"""What long demos share: a table on screen, interruption, checkpoints, restart."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from raymortar.core.contact import State
from raymortar.core.errors import raise_everywhere


def add_options(parser):
    """Options of demos that can be interrupted."""
    parser.add_argument("--checkpoint", type=Path, help="file to save the path to")
    parser.add_argument("--every", type=int, default=10, help="steps per checkpoint")
    parser.add_argument("--restart", type=Path, help="checkpoint to go on from")


def cells(contact):
    """Numbers of this rank's cells in the order in which the mesh was given.

    Scenes are cut in the same way in every run, unless a partition says otherwise.
    """
    return contact.u.function_space.mesh.topology.original_cell_index


# Before the names of a state's arrays in a file
OF_STATE = "state of contact "


def rank_file(path, comm):
    """Each rank keeps its own part of a checkpoint."""
    return path if comm.size == 1 else path.with_suffix(f".{comm.rank}.npz")


def save(path, contact, rows, **more):
    """Write the accepted state, the path so far and more arrays of this rank.

    The file is replaced at once: an interruption leaves the old one or the new one.
    """
    comm, state = contact.layout.comm, contact.state()
    path = rank_file(path, comm)
    part = path.with_suffix(".part.npz")
    np.savez(
        part,
        rows=np.array(rows),
        ranks=comm.size,
        cells=cells(contact),
        **{OF_STATE + name: array for name, array in state.items()},
        **more,
    )
    os.replace(part, path)


# What NumPy raises for a file that is missing, cut short or something else
DAMAGE = (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile, zlib.error)


def ranks_of(path, comm):
    """Number of ranks that wrote a checkpoint, 0 where there is none to be read."""
    for part in (rank_file(path, comm), path, path.with_suffix(".0.npz")):
        try:
            with np.load(part) as data:
                return int(data["ranks"])
        except DAMAGE:
            pass
    return 0


def load(path, contact, row):
    """Go back to a checkpoint of the same mesh, ranks and partition.

    Returns the rows, as objects of the class `row`, and the other arrays.
    """
    comm = contact.layout.comm
    found, problem = {}, None
    ranks = ranks_of(path, comm)
    if ranks not in (0, comm.size):
        problem = f"{path} was written by {ranks} rank(s), this run has {comm.size}"
    raise_everywhere(comm, problem, SystemExit)
    try:
        with np.load(rank_file(path, comm)) as data:
            found = {name: data[name] for name in data.files}
        same = np.array_equal(found.pop("cells"), cells(contact))
        if found.pop("ranks") != comm.size or not same:
            problem = f"{path} is of another mesh, partition or number of ranks"
        else:
            rows = [row(*values) for values in found.pop("rows")]
            names = [name for name in found if name.startswith(OF_STATE)]
            state = State((n[len(OF_STATE) :], found.pop(n)) for n in names)
    except DAMAGE as error:
        problem = f"{path} is not a whole checkpoint: {error}"
    raise_everywhere(comm, problem, SystemExit)
    contact.restore(state)
    return rows, found


def resume(history, rows):
    """Let a file of the path go on after the rows of a checkpoint, where there is one."""
    comm = history.problem.comm
    if rows and comm.bcast(history.path is not None and history.path.exists(), root=0):
        history.resume(until=rows[-1].t)


@dataclass
class Record:
    """Keeps the rows: on screen, and in a checkpoint every few steps.

    Attributes
    ----------
    heading, line
        Head of the table on screen, and what makes a line of a row.
    more
        Arrays by name that a checkpoint keeps besides, when it is written.
    """

    contact: Any
    checkpoint: Path | None
    every: int
    rows: list
    heading: str
    line: Callable
    more: Callable[[], dict] = dict

    def say(self, text):
        if self.contact.layout.comm.rank == 0:
            print(text, flush=True)

    def follow(self, path):
        """Record the rows of a path; False if interrupted from the keyboard."""
        self.say(f"  step{self.heading}")
        try:
            for row in path:
                self.rows.append(row)
                self.say(f"{len(self.rows):6}{self.line(row)}")
                if len(self.rows) % self.every == 0:
                    self.write()
        except KeyboardInterrupt:
            where = self.checkpoint or "a file given by --checkpoint"
            self.say(f"interrupted: --restart continues from {where}")
            return False
        self.write()
        return True

    def write(self):
        """The checkpoint if one is asked for."""
        if self.checkpoint is not None:
            save(self.checkpoint, self.contact, self.rows, **self.more())
