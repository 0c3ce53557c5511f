"""What a push runs of the tests: the list of long ones, and the choice in families."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from selection import each_value, of_a_push, of_each_file

TESTS = Path(__file__).parents[1]


def test_the_list_is_sorted_and_names_files_that_are_there():
    lines = (TESTS / "nightly.txt").read_text(encoding="utf-8").splitlines()
    names = [line for line in lines if not line.startswith("#")]
    assert names == sorted(set(names))
    for name in names:
        file, _, function = name.partition("[")[0].partition("::")
        text = (TESTS.parent / file).read_text(encoding="utf-8")
        assert not function or f"def {function}(" in text, name


class Item(SimpleNamespace):
    """An item of pytest as far as the choice reads it."""

    __hash__ = object.__hash__
    __eq__ = object.__eq__


def member(name, *marks, groups=(), **params):
    found = {mark: [mark] for mark in marks}
    found["parametrize"] = [SimpleNamespace(args=[group]) for group in groups]
    item = Item(
        nodeid=f"{name}[{params}]" if params else name,
        iter_markers=lambda mark: found.get(mark, []),
        get_closest_marker=found.get,
    )
    if params:
        item.callspec = SimpleNamespace(params=params)
    return item


CELLS, LAWS = ("triangle", "hexahedron", "line"), ("stick", "slip")


def family(name="t.py::test_a", **options):
    return [
        member(name, cell=cell, law=law, **options) for cell in CELLS for law in LAWS
    ]


def test_each_value_occurs_with_few_members():
    chosen = each_value(family())
    assert len(chosen) == 3
    assert {item.callspec.params["cell"] for item in chosen} == set(CELLS)
    assert {item.callspec.params["law"] for item in chosen} == set(LAWS)


def test_parameters_that_are_listed_together_stay_together():
    assert len(each_value(family(groups=["cell, law"]))) == 6


def test_of_a_product_that_is_listed_each_value_occurs():
    laws = (*LAWS, "stick or slip")
    product = [
        member("t.py::test_a", cell=cell, law=law, groups=["cell, law"])
        for cell in CELLS
        for law in laws
    ]
    chosen = each_value(product)
    assert len(chosen) == 3
    assert {item.callspec.params["law"] for item in chosen} == set(laws)


def test_of_all_four_cells_a_plane_one_and_one_of_space_occur():
    cells, found = ("triangle", "quadrilateral", "tetrahedron", "hexahedron"), set()
    for i in range(20):
        name = f"t.py::test_{i}"
        product = [member(name, cell=cell, law=law) for cell in cells for law in LAWS]
        params = [item.callspec.params for item in each_value(product)]
        pair = tuple(one["cell"] for one in params)
        assert pair in {(cells[0], cells[3]), (cells[1], cells[2])}
        assert {one["law"] for one in params} == set(LAWS)
        found.add(pair)
        # Laws of which some cell alone has one stay
        listed = [member(name, cell=cell, law=cell * 2) for cell in cells]
        assert each_value(listed) == listed
    assert len(found) == 2


def test_of_a_family_that_is_named_two_unlike_members_run():
    families = [family(f"t.py::test_{i}") for i in range(20)]
    found = of_a_push(sum(families, []), {f"t.py::test_{i}" for i in range(20)}, 1)
    pairs = [[item.callspec.params for item in found if item in f] for f in families]
    assert all(a["cell"] != b["cell"] and a["law"] != b["law"] for a, b in pairs)
    assert {params["cell"] for pair in pairs for params in pair} == set(CELLS)


@pytest.mark.parametrize("ranks, fourths", ((2, (1, 6)), (3, (0, 5))))
def test_on_several_ranks_a_file_runs_every_fourth_function(ranks, fourths):
    quick = [member("t.py::test_quick", "quick")]
    many = [member("t.py::test_many", "many_ranks")]
    functions = [quick, *(family(f"t.py::test_{i}") for i in range(1, 8)), many]
    others = [family(f"other.py::test_{i}") for i in range(3)]
    items = sum([*functions, *others], [])
    long = {functions[2][0].nodeid, *(f"other.py::test_{i}" for i in range(3))}
    # With --quick, all that are quick run on 2
    always = {0, 8} if ranks == 2 else {8}
    kept = sorted(always.union(fourths))
    expected = [*(functions[i] for i in kept), others[0]]
    assert of_each_file(items, long, ranks) == sum(expected, [])


def test_a_file_that_is_named_runs_on_several_ranks_at_night_only():
    many = member("t.py::test_many", "many_ranks")
    items = [*family(), *family("t.py::test_b"), many, *family("other.py::test_c")]
    found = of_each_file(items, {"t.py", "t.py::test_b"}, 3)
    assert found == items[items.index(many) :]
    assert of_a_push(items[:7], {"t.py"}, 1) == of_a_push(items[:7], set(), 1)


def test_on_several_ranks_a_family_has_one_member_and_not_the_same_everywhere():
    families = [family(f"t.py::test_{i}") for i in range(20)]
    single = member("t.py::test_single")
    chosen = of_a_push([single, *sum(families, [])], set(), 2)
    assert chosen[0] is single and len(chosen) == 21
    assert [item in members for item, members in zip(chosen[1:], families)] == 20 * [1]
    for name, values in (("cell", CELLS), ("law", LAWS)):
        assert {item.callspec.params[name] for item in chosen[1:]} == set(values)


@pytest.mark.parametrize("ranks", (1, 2))
def test_long_ones_are_left_out_unless_they_are_quick(ranks):
    long, kept = member("t.py::test_a"), member("t.py::test_b", "quick")
    names = {long.nodeid, kept.nodeid}
    assert of_a_push([long, kept], names, ranks) == [kept]
