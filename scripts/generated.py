"""Parts of pages that a script writes, between two comments."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def parts(kind: str) -> re.Pattern[str]:
    """Match a part: its name, and what is between its comments."""
    return re.compile(
        rf"^<!-- {kind}: (.+?) -->\n(.*?)^<!-- end -->$", re.MULTILINE | re.DOTALL
    )


def rewritten(text: str, kind: str, make: Callable[[str], str]) -> str:
    """Put what `make` gives for the name of each part into the page."""

    def part(found: re.Match[str]) -> str:
        body = make(found[1]).strip("\n")
        return f"<!-- {kind}: {found[1]} -->\n\n{body}\n\n<!-- end -->"

    return parts(kind).sub(part, text)


def update(
    pages: Iterable[Path],
    kind: str,
    make: Callable[[Path, str], str],
    check: bool,
    same: Callable[[str], str] = str,
) -> list[Path]:
    """Write the parts of all pages anew, or with `check` only name what would change.

    `same` makes texts alike that differ in what `check` overlooks. Returns the
    pages that are not as they should be.
    """
    found = []
    for page in pages:
        old = page.read_text(encoding="utf-8")
        new = rewritten(old, kind, lambda name: make(page, name))
        if same(new) == same(old) and (check or new == old):
            continue
        found.append(page)
        if not check:
            page.write_text(new, encoding="utf-8")
    return found
