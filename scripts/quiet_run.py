"""quiet_run.py FILE|-m MODULE|-c COMMAND [ARGS...]

Runs a program as ``python -m mpi4py`` does, without the lines that setuptools logs while
it compiles a form (``INFO:root:running build_ext``). Everything else that programs log is
left alone. RAYMORTAR_COMPILER_LOG=1 shows those lines, too.
"""

import logging
import os
import sys
import traceback

from mpi4py import MPI
from mpi4py.run import main


def is_of_interest(record: logging.LogRecord) -> bool:
    """Whether a record is none of what setuptools says while it builds."""
    of_build = "distutils" in record.pathname or "setuptools" in record.pathname
    return record.levelno > logging.INFO or not of_build


def leave(code: object) -> None:
    """End all ranks at once, while the program's objects still live: PETSc destroys them
    on all ranks together, and the others are elsewhere."""
    if MPI.COMM_WORLD.size > 1:
        if not isinstance(code, int):
            print(code, file=sys.stderr)
        sys.stdout.flush()
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(code if isinstance(code, int) else 1)


if __name__ == "__main__":
    if os.environ.get("RAYMORTAR_COMPILER_LOG", "0") == "0":
        logging.getLogger().addFilter(is_of_interest)
    # As with -m; for a file mpi4py puts its folder here
    sys.path[0] = os.getcwd()
    try:
        main()
    except SystemExit as end:
        if end.code not in (None, 0):
            leave(end.code)
        raise
    except BaseException:
        if MPI.COMM_WORLD.size > 1:
            traceback.print_exc()
        leave(1)
        raise
