"""quiet_run.py FILE|-m MODULE|-c COMMAND [ARGS...]

Runs a program as Python does, without the lines that setuptools logs while it compiles a
form (``INFO:root:running build_ext``). Everything else that programs log is left alone.
RAYMORTAR_COMPILER_LOG=1 shows those lines, too.

An error ends the program on all ranks. It is shown once, without frames of this file.
"""

import logging
import os
import runpy
import sys
import time
from types import TracebackType

from mpi4py import MPI

# Seconds in which the first rank shows an error that all ranks have, and ends them
FIRST = 2.0
OWN = __file__, "<frozen runpy>", runpy.__file__


def is_of_interest(record: logging.LogRecord) -> bool:
    """Whether a record is none of what setuptools says while it builds."""
    of_build = "distutils" in record.pathname or "setuptools" in record.pathname
    return record.levelno > logging.INFO or not of_build


def run(first: str, *rest: str) -> None:
    """Run a file, a module or a command as the main program."""
    if first == "-m":
        sys.argv = list(rest)
        runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
    elif first == "-c":
        sys.argv = ["-c", *rest[1:]]
        exec(compile(rest[0], "<string>", "exec"), {"__name__": "__main__"})
    else:
        sys.argv, sys.path[0] = [first, *rest], os.path.dirname(os.path.abspath(first))
        runpy.run_path(first, run_name="__main__")


def of_program(frames: TracebackType | None) -> TracebackType | None:
    """Leave out the frames by which the program was started."""
    while frames is not None and frames.tb_frame.f_code.co_filename in OWN:
        frames = frames.tb_next
    return frames


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
    # As with -m; for a file `run` puts its folder here
    sys.path[0] = os.getcwd()
    try:
        run(*sys.argv[1:])
    except SystemExit as end:
        if end.code not in (None, 0):
            leave(end.code)
        raise
    except BaseException as error:
        if MPI.COMM_WORLD.rank > 0:
            time.sleep(FIRST)
        error.__traceback__ = of_program(error.__traceback__)
        sys.excepthook(type(error), error, error.__traceback__)
        leave(1)
        sys.exit(1)
