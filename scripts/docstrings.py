"""Docstrings in numpydoc's form, and what of them becomes Markdown."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field

SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}$", re.MULTILINE)
LITERAL = re.compile(r"``([^`]+)``")
REFERENCE = re.compile(r"(?<![`\w])`([^`\n]+)`(?!`)")
ROLE = re.compile(r":math:`([^`]+)`")
OTHER_ROLE = re.compile(r":\w+:(?=`)")
# Makes Markdown of the name in a reference
Link = Callable[[str], str]

ITEM = re.compile(r"^(?:[-*]|\d+\.) ")


@dataclass
class Docstring:
    """The text of a docstring, and its sections by name."""

    text: str
    sections: dict[str, str] = field(default_factory=dict)

    @staticmethod
    def of(source: str | None) -> Docstring:
        """Split a docstring into its text and its sections."""
        heads = SECTION.split(source or "")
        return Docstring(
            heads[0].strip(),
            {name: text.strip("\n") for name, text in zip(heads[1::2], heads[2::2])},
        )

    def entries(self, name: str) -> list[tuple[str, str]]:
        """Names and descriptions of a section; of a section without names one text."""
        found: list[tuple[str, list[str]]] = []
        for line in textwrap.dedent(self.sections.get(name, "")).split("\n"):
            if line and not line.startswith(" "):
                found.append((line.strip(), []))
            elif found:
                found[-1][1].append(line)
        return [(head, textwrap.dedent("\n".join(text))) for head, text in found]


def paragraphs(text: str) -> list[str]:
    """Join the lines of each paragraph and of each item of a list."""
    found: list[str] = []
    code: list[str] = []
    is_open = False
    for line in text.split("\n"):
        stripped = line.strip()
        if stripped.startswith(">>>") or (code and stripped):
            code.append(stripped.removeprefix(">>> ").removeprefix("... "))
            continue
        if code:
            found.append("```python\n" + "\n".join(code) + "\n```")
            code = []
        if not stripped:
            is_open = False
        elif is_open and not ITEM.match(stripped):
            found[-1] += f" {stripped}"
        else:
            found.append(stripped)
            is_open = True
    if code:
        found.append("```python\n" + "\n".join(code) + "\n```")
    return found


def formulas(text: str) -> str:
    """Formulas of reStructuredText as in Markdown; other roles are left out."""
    text = re.sub(r"\.\. math:: (.+)", r"$\1$", text)
    return OTHER_ROLE.sub("", ROLE.sub(r"$\1$", text))


def inline(text: str, link: Link) -> str:
    """Literals and references in Markdown; `link` makes a reference's link."""
    text = LITERAL.sub("\0\\1\1", formulas(text))
    text = REFERENCE.sub(lambda found: link(found[1]), text)
    return text.replace("\0", "`").replace("\1", "`")
