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


def with_tree(app, name, source):
    """The pages that a list links to are its branches, for those in folders below too."""
    if Path(name).name == "index" and "{toctree}" not in source[0]:
        links = re.findall(r"\]\(([\w/]+)\.md\)", source[0])
        folder = Path(app.srcdir) / Path(name).parent
        pages = [
            link
            for link in dict.fromkeys(links)
            if "/" not in link or link.endswith("/index")
            if (folder / f"{link}.md").is_file() and link != "index"
        ]
        source[0] += "\n```{toctree}\n:hidden:\n\n" + "\n".join(pages) + "\n```\n"


def setup(app):
    """Read the pages as they are shown elsewhere."""
    app.connect("source-read", with_directives)
    app.connect("source-read", with_tree)
