"""Tables of docs/measured are what the rows of their CSV files say."""

from __future__ import annotations

import importlib.machinery
import importlib.util
import re
import subprocess
import sys

import pytest
from programs import ROOT

PAGES = sorted((ROOT / "docs" / "measured").glob("*.md"))


@pytest.fixture(scope="module")
def measured():
    """`scripts/measured` as a module."""
    sys.path.insert(0, str(ROOT / "scripts"))
    loader = importlib.machinery.SourceFileLoader(
        "measured", str(ROOT / "scripts" / "measured")
    )
    spec = importlib.util.spec_from_loader("measured", loader)
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


@pytest.mark.quick
def test_every_table_is_what_its_file_says():
    command = [sys.executable, str(ROOT / "scripts" / "measured"), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.quick
def test_every_table_is_on_a_page_with_a_day(measured):
    text = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
    shown = re.findall(r"^<!-- measured: (\S+) -->$", text, re.MULTILINE)
    assert sorted(shown) == sorted(measured.formats.TABLES)
    assert len(measured.DAY.findall(text)) == len(shown)


@pytest.mark.parametrize(
    "old, new, is_noticed",
    [("| 0.1 | 5 | 0 | 4 |", "| 0.1 | 5 | 0 | 3 |", True), ("-22:", "-23:", False)],
)
def test_what_differs_from_the_file_is_noticed(
    measured, tmp_path, old, new, is_noticed
):
    """A figure is; the day is that of the commit, which a check cannot ask for."""
    page = tmp_path / "page.md"
    page.write_text("# A page\n\n<!-- measured: gamma_blocks -->\n<!-- end -->\n")

    def update(check):
        return measured.generated.update(
            [page],
            "measured",
            measured.made,
            check,
            lambda text: measured.DAY.sub(r"\1", text),
        )

    assert update(check=False) == [page] and update(check=True) == []
    text = re.sub(r"\d{4}-\d\d-\d\d:", "2026-11-22:", page.read_text())
    assert old in text
    page.write_text(text.replace(old, new))
    assert update(check=True) == ([page] if is_noticed else [])
