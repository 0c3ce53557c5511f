"""Every message of an error is in the appendix of messages, and in no guide's table."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "check_messages"


def check(*arguments):
    """Return code of the script, and what it complained about."""
    command = [sys.executable, str(SCRIPT), *map(str, arguments)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    return run.returncode, run.stderr


def make_tree(root, source, guide="# A guide\n"):
    """A tree with one source file and a page with two messages."""
    page = "| `tag 7 is on no facet` | |\n```text\nThe sky fell after 3 steps\n```\n"
    for name, text in (
        ("docs/messages/setup.md", page),
        ("docs/guide.md", guide),
        ("python/raymortar/some.py", source),
    ):
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return root


@pytest.mark.quick
def test_the_appendix_has_every_message():
    assert check() == (0, "")


@pytest.mark.parametrize(
    "source",
    [
        'raise ContactError(f"tag {tag} is on no facet")\n',
        'raise ConvergenceError(f"the sky fell after {n} steps: {why}")\n',
        'raise_everywhere(comm, None if good else f"tag {tag} is on no facet")\n',
        'raise ValueError("not one of ours, and not documented")\n',
    ],
)
def test_what_is_on_the_page_passes(tmp_path, source):
    assert check(make_tree(tmp_path, source)) == (0, "")


@pytest.mark.parametrize(
    "source",
    [
        'raise ContactError(f"facet {facet} has no friends")\n',
        'raise ContactError(\n    f"facet {facet} "\n    "has no friends"\n)\n',
        'raise_everywhere(comm, "facet has no friends" if bad else None)\n',
        'problem = f"facet {facet} has no friends"\n',
        'def fault(x) -> str | None:\n    return f"facet {x} has no friends"\n',
    ],
)
def test_what_is_not_on_the_page_is_named(tmp_path, source):
    code, complaint = check(make_tree(tmp_path, source))
    assert code == 1
    assert "python/raymortar/some.py: docs/messages does not have" in complaint
    assert "has no friends" in complaint


def test_a_table_of_messages_in_a_guide_is_named(tmp_path):
    guide = "# A guide\n\n| message | remedy |\n|---|---|\n| `it fell` | |\n"
    code, complaint = check(make_tree(tmp_path, "", guide))
    assert code == 1
    assert complaint == "docs/guide.md: a table of messages belongs to docs/messages\n"


@pytest.mark.parametrize(
    "text, fault",
    [
        ("tag 7 is on no facet. It fell. Take tag 8", "more than 2 sentences"),
        (
            "tag 7 is on no facet: take tag 8. It has some",
            "is not in the last sentence",
        ),
        ("tag 7 is on no facet. Take tag 8", None),
        ("tag 7 (of 8.5) is on no facet: take tag 8", None),
    ],
)
@pytest.mark.parametrize("call", ["raise ContactError({!r})", "warn({!r}, 2)"])
def test_messages_have_two_sentences_and_the_remedy_last(tmp_path, text, fault, call):
    code, complaint = check(make_tree(tmp_path, call.format(text) + "\n"))
    if fault is None:
        assert (code, complaint) == (0, "")
    else:
        assert code == 1 and fault in complaint
