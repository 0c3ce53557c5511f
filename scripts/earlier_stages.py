"""Pytest plugin of scripts/test: one count, and the seconds, of every stage.

In the last of them all tests have run before; their JUnit reports are named in
RAYMORTAR_REPORTS. Each case in them becomes an item here with the outcome it
had, so that pytest's closing count is of everything.
"""

import os
import sys
import time
from xml.etree import ElementTree

import pytest


class EarlierTest(pytest.Item):
    """A test that has run already."""

    def __init__(self, *, case, report, **kwargs):
        super().__init__(**kwargs)
        self._case = case
        self._report = report

    def runtest(self):
        for failure in [*self._case.iter("failure"), *self._case.iter("error")]:
            pytest.fail(failure.get("message") or failure.text, pytrace=False)
        skipped = self._case.find("skipped")
        if skipped is not None or self._case.get("status") == "notrun":
            pytest.skip("skipped in its own stage")

    def reportinfo(self):
        return self._report, None, self.name


def _earlier_tests(session):
    for report in filter(None, os.environ.get("RAYMORTAR_REPORTS", "").split(":")):
        for case in ElementTree.parse(report).iter("testcase"):
            name = f"{case.get('classname')}.{case.get('name')}"
            yield EarlierTest.from_parent(session, name=name, case=case, report=report)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(session, items):
    items += _earlier_tests(session)


def pytest_terminal_summary(terminalreporter):
    """Seconds of each stage: RAYMORTAR_STAGES has a line with begin and name of each."""
    lines = os.environ.get("RAYMORTAR_STAGES", "").splitlines()
    if not lines:
        return
    begins, names = zip(*(line.split(" ", 1) for line in lines))
    end = int(time.time()) - int(os.environ["RAYMORTAR_STARTED"])
    times = [int(begin) for begin in begins] + [end]
    terminalreporter.section("seconds of each stage")
    for name, first, last in zip(names, times, times[1:]):
        terminalreporter.write_line(f"{last - first:5d} {name}")
    terminalreporter.write_line(f"{end:5d} in all, without building")


def pytest_sessionfinish(session, exitstatus):
    session.config.earlier_stages_status = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    # A rank that failed must not wait in MPI_Finalize for one that waits for
    # it: leave at once, and mpirun ends the others
    status = getattr(config, "earlier_stages_status", 0)
    if status not in (0, 5) and os.environ.get("OMPI_COMM_WORLD_SIZE", "1") != "1":
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
