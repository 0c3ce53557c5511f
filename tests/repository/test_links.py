"""Links between pages lead somewhere, and the theory says where each equation is."""

import importlib.util
import re
from types import SimpleNamespace

import pytest
from programs import ROOT

FOLDERS = ("docs", "meshes", "benchmarks", "packaging")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
FENCED = re.compile(r"^(```+)[^\n]*\n.*?^\1", re.MULTILINE | re.DOTALL)
LINKED = re.compile(r"\[([^\]]*)\]\([^)]*\)")
CELL = re.compile(r"(?<!\\)\|")
NUMBERED = re.compile(r"\\qquad \((\d+)\.(\d+)\)$", re.MULTILINE)
RANGE = re.compile(r"\((\d+)\.(\d+)\)(?: to \(\d+\.(\d+)\))?")
# Words of the glossary that no textbook has, or that have another meaning there
TERMS = (
    *("slave", "pairing", "segments?", "covered", "multipliers?", "held nodes?"),
    *("loose bod(?:y|ies)", "free bod(?:y|ies)"),
)
# Code, links, headings, rows of tables, bold words and formulas
NO_PROSE = re.compile(
    r"`[^`\n]*`|\[[^\]]*\]\([^)]*\)|^[#|!][^\n]*$|^[^\n]*<!--[^\n]*$|\*\*[^*\n]*\*\*|"
    r"\$[^$\n]*\$",
    re.MULTILINE,
)
# Pages for those who know the words
OF_DEVELOPERS = {"index", "developers", "extending", "testing", "cpp", "install"}
# Words in a cell of a guide's tables
WORDS = 15
# Lines of a page: of a guide, of any other
LONGEST = {True: 150, False: 200}
# Guides, and five that are none: start, installation, C++, developers, tests
MOST = 28


def pages():
    """Every page in the tree, by its place."""
    found = [*ROOT.glob("*.md")]
    for folder in FOLDERS:
        found += (ROOT / folder).rglob("*.md")
    return sorted(path.relative_to(ROOT) for path in found)


def prose(path):
    """Text of a page without its blocks of code."""
    return FENCED.sub("", (ROOT / path).read_text(encoding="utf-8"))


def anchors(path):
    """Names of a page's headings, as GitHub and MyST make them."""
    headings = re.findall(r"^#+ (.*)$", prose(path), re.MULTILINE)
    plain = [re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings]
    return {heading.strip().replace(" ", "-") for heading in plain}


@pytest.mark.quick
@pytest.mark.parametrize("page", pages(), ids=str)
def test_links_lead_somewhere(page):
    for target in LINK.findall(prose(page)):
        if target.startswith(("http", "mailto")):
            continue
        place, _, anchor = target.partition("#")
        path = (ROOT / page.parent / place).resolve() if place else ROOT / page
        assert path.exists(), f"{page} links to {target}"
        assert not (page.parts[0] == "docs" and path.suffix == ".md") or (
            path.is_relative_to(ROOT / "docs")
        ), f"{page} links to {target}, a page that the documentation does not have"
        if anchor and path.suffix == ".md":
            assert anchor in anchors(path), f"{page} links to {target}"


@pytest.mark.quick
@pytest.mark.parametrize(
    "page",
    [page for page in pages() if str(page.parent) in ("docs", "docs/demos")],
    ids=str,
)
def test_cells_of_tables_are_short(page):
    """A reader takes in a row at a glance; what needs more is said below the table."""
    rows = [line for line in prose(page).splitlines() if line.startswith("|")]
    cells = [cell for row in rows for cell in CELL.split(row.strip())[1:-1]]
    long = [c for c in cells if len(LINKED.sub(r"\1", c).split()) > WORDS]
    assert not long


@pytest.mark.quick
@pytest.mark.parametrize(
    "page",
    [
        page
        for page in pages()
        if str(page.parent) == "docs" and page.stem not in OF_DEVELOPERS
    ],
    ids=str,
)
def test_a_guide_links_its_words_to_the_glossary(page):
    text = prose(page)
    rest = NO_PROSE.sub("", text)
    used = [term for term in TERMS if re.search(rf"(?<![\w-]){term}(?![\w-])", rest)]
    missing = [
        term for term in used if not re.search(rf"\[{term}\]\(index\.md#gl", text)
    ]
    assert not missing


@pytest.mark.quick
@pytest.mark.parametrize(
    "folder", [str(page.parent) for page in pages() if page.name == "index.md"]
)
def test_a_list_links_to_every_page_of_its_folder(folder):
    """Also on a code host, which shows no toctree."""
    text = prose(f"{folder}/index.md")
    pages = {path.name for path in (ROOT / folder).glob("*.md")} - {"index.md"}
    linked = set(re.findall(r"\]\(([\w.]+)\)", text))
    assert pages <= linked


@pytest.mark.quick
def test_a_list_has_its_links_as_branches_of_the_tree():
    """Those of its folder, and the lists of folders below."""
    spec = importlib.util.spec_from_file_location("conf", ROOT / "docs" / "conf.py")
    conf = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(conf)
    app = SimpleNamespace(srcdir=ROOT / "docs")
    source = ["[a](install.md), [b](api/index.md), [c](api/contact.md), [d](no.md)\n"]
    conf.with_tree(app, "index", source)
    assert source[0].endswith("```{toctree}\n:hidden:\n\ninstall\napi/index\n```\n")


@pytest.mark.quick
def test_pages_are_short():
    """Who looks something up reads one page to its end."""
    lengths = {
        page: (ROOT / page).read_text(encoding="utf-8").count("\n")
        for page in pages()
        if page.parts[0] == "docs"
    }
    guides = {page: len(page.parts) == 2 for page in lengths}
    too_long = {page for page, n in lengths.items() if n > LONGEST[guides[page]]}
    assert too_long == set()
    assert sum(guides.values()) <= MOST


@pytest.mark.quick
def test_each_equation_is_on_the_page_that_the_theory_names():
    folder = ROOT / "docs" / "theory"
    said, found = {}, {}
    for row in re.findall(
        r"^\| \[.*$", (folder / "index.md").read_text(), re.MULTILINE
    ):
        name = re.search(r"\]\((\w+\.md)\)", row)[1]
        for section, first, last in RANGE.findall(row.split("|")[-2]):
            numbers = range(int(first), int(last or first) + 1)
            said |= {(section, str(number)): name for number in numbers}
    for path in folder.glob("*.md"):
        text = path.read_text(encoding="utf-8")
        found |= dict.fromkeys(NUMBERED.findall(text), path.name)
    assert len(found) > 60
    assert said == found
