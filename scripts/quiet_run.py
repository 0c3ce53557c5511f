"""quiet_run.py FILE|-m MODULE|-c COMMAND [ARGS...]

Runs a program as ``python -m mpi4py`` does, without the lines that setuptools logs while
it compiles a form (``INFO:root:running build_ext``). Everything else that programs log is
left alone. RAYMORTAR_COMPILER_LOG=1 shows those lines, too.
"""

import logging
import os
import sys

from mpi4py.run import main


def is_of_interest(record: logging.LogRecord) -> bool:
    """Whether a record is none of what setuptools says while it builds."""
    of_build = "distutils" in record.pathname or "setuptools" in record.pathname
    return record.levelno > logging.INFO or not of_build


if __name__ == "__main__":
    if os.environ.get("RAYMORTAR_COMPILER_LOG", "0") == "0":
        logging.getLogger().addFilter(is_of_interest)
    # As with -m; for a file mpi4py puts its folder here
    sys.path[0] = os.getcwd()
    main()
