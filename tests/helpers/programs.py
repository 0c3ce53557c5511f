"""Programs of the pages, run as a user would."""

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def blocks_of(page, kind):
    """Fenced blocks of a page."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{kind}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def more_ranks_than_cores():
    """Options of mpirun, as in scripts/setup.sh."""
    said = subprocess.run(["mpirun", "--version"], capture_output=True, text=True)
    options = ["--map-by", ":OVERSUBSCRIBE", "--bind-to", "none"]
    return options if "Open MPI" in said.stdout else []


def run(program, folder, ranks=1, **environment):
    """Output of a program that is run in a folder."""
    (folder / "program.py").write_text(program, encoding="utf-8")
    # Pages read meshes from the root of the tree, where their readers are
    if not (folder / "meshes").exists():
        (folder / "meshes").symlink_to(ROOT / "meshes")
    command = [sys.executable, "program.py"]
    if ranks > 1:
        command[1:1] = ["-m", "mpi4py"]
        command[:0] = ["mpirun", *more_ranks_than_cores(), "-n", str(ranks)]
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "ContactWarning" not in done.stderr, done.stderr
    return done.stdout.strip()
