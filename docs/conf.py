"""Sphinx settings; `scripts/docs` builds the pages."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

project = "raymortar"
author = "The raymortar authors"
release = re.search(
    r'^version = "([\d.]+)"', (ROOT / "pyproject.toml").read_text(), re.MULTILINE
)[1]

extensions = ["myst_parser", "sphinx.ext.mathjax"]
exclude_patterns = ["_build"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

html_theme = "furo"
html_title = f"raymortar {release}"


def with_directives(app, name, source):
    """Formulas are fenced as for GitHub, which MyST would show as code."""
    source[0] = source[0].replace("\n```math\n", "\n```{math}\n")


def with_other_pages(app, name, source):
    """The start page lists every page that it does not name itself."""
    if name == "index":
        pages = {page.stem for page in Path(app.srcdir).glob("*.md")} - {"index"}
        others = sorted(pages - set(source[0].split("\n")))
        source[0] = source[0].replace("OTHER_PAGES", "\n".join(others))


def setup(app):
    """Read the pages as they are shown elsewhere."""
    app.connect("source-read", with_directives)
    app.connect("source-read", with_other_pages)
