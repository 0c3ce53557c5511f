"""Pytest plugin of scripts/test: counts the package's lines that tests reach.

Each process keeps what it has reached in RAYMORTAR_COVERAGE, a folder. In the last stage,
with RAYMORTAR_REPORTS, all of it is added up to one figure. Tests take a fifth longer with
it: tests marked "quick" count, and with RAYMORTAR_COVERAGE_OF=all, as at night, all do.
"""

import os
from importlib.util import find_spec
from pathlib import Path

import coverage
import pytest

FOLDER = Path(os.environ["RAYMORTAR_COVERAGE"])
PACKAGE = Path(find_spec("raymortar").submodule_search_locations[0])
COUNTED = os.environ.get("RAYMORTAR_COVERAGE_OF") or "quick"


def _counter():
    return coverage.Coverage(
        data_file=str(FOLDER / "lines"),
        data_suffix=True,
        include=[f"{PACKAGE}/*"],
        config_file=False,
        messages=False,
    )


_COUNTER = None
if "RAYMORTAR_REPORTS" not in os.environ:
    _COUNTER = _counter()
    _COUNTER.start()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    is_left_out = COUNTED != "all" and item.get_closest_marker(COUNTED) is None
    if is_left_out and _COUNTER is not None:
        _COUNTER.stop()
    yield
    if is_left_out and _COUNTER is not None:
        _COUNTER.start()


def pytest_unconfigure():
    if _COUNTER is not None:
        _COUNTER.stop()
        _COUNTER.save()


def pytest_terminal_summary(terminalreporter):
    """The share of lines, of all files of the package."""
    if _COUNTER is None and any(FOLDER.glob("lines.*")):
        found = coverage.Coverage(
            data_file=str(FOLDER / "lines"),
            source=[str(PACKAGE)],
            config_file=False,
            messages=False,
        )
        found.combine()
        with open(os.devnull, "w", encoding="utf-8") as nowhere:
            share = found.report(file=nowhere)
        terminalreporter.write_line(
            f"{share:.1f} % of the lines of python/raymortar are reached on one rank by "
            f"{COUNTED} tests"
        )
