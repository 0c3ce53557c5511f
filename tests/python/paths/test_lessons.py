"""Which way to solve a step goes first."""

from raymortar.paths.prediction import Lessons

PLAIN, OTHER, THIRD = "plain", "other", "third"


def first_ways(solved, steps):
    """Names of the ways that begin steps; `solved` is what solves once plain fails."""
    lessons, found = Lessons(PLAIN), []
    for k in range(steps):
        way = lessons.first()
        found.append(way)
        if way == PLAIN:
            name = solved(k)
            lessons.solved(name, plain_failed=name != PLAIN)
    return found


def test_a_plain_solver_that_works_stays():
    assert first_ways(lambda k: PLAIN, 5) == 5 * [PLAIN]


def test_what_solved_two_steps_goes_first_for_longer_and_longer():
    found = first_ways(lambda k: OTHER, 30)
    rests = [2, 4, 8, 8]
    expected = 2 * [PLAIN]
    for rest in rests:
        expected += rest * [OTHER] + [PLAIN]
    assert found[: len(expected)] == expected


def test_ways_that_take_turns_teach_nothing():
    assert first_ways(lambda k: (OTHER, THIRD)[k % 2], 9) == 9 * [PLAIN]


def test_the_plain_solver_stays_once_it_works_again():
    found = first_ways(lambda k: OTHER if k < 4 else PLAIN, 9)
    assert found == [PLAIN, PLAIN, OTHER, OTHER, PLAIN, PLAIN, PLAIN, PLAIN, PLAIN]


def test_another_way_leads_after_two_steps_in_a_row():
    """Then the plain solver may start from where the path leads."""
    lessons, leads = Lessons(PLAIN), []
    for way in (OTHER, OTHER, OTHER, PLAIN, PLAIN):
        leads.append(lessons.another_leads)
        lessons.solved(way, plain_failed=way != PLAIN)
    assert leads == [False, False, True, True, False]
