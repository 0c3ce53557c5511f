"""Cases of other codes and of public reports: their figures and ours.

run.py [NAME ...]

Writes cases.csv beside it, a row for each figure, from the cases of `tests/field`. With
names only those are solved that have one of them in theirs, and all other rows stay.
"""

import csv
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "tests" / folder) for folder in ("field", "helpers")]
sys.path.insert(0, str(ROOT))

from registry import all_cases  # noqa: E402

FILE = HERE / "cases.csv"
NAMES = (
    "case law code source scene quantity reference ours deviation allowed iterations "
    "verdict"
).split()


def rows_of(case):
    """Solve a case; a row for each of its figures."""
    outcome = case.solve()
    name, _, law = case.name.partition("-")
    about = [name, law, case.code, case.source, case.scene]
    for figure, value in zip(case.figures, outcome.values):
        deviation = figure.deviation(value)
        numbers = [repr(float(x)) for x in (figure.reference, value, deviation)]
        yield [*about, figure.quantity, *numbers, figure.tolerance, outcome.effort,
               case.verdict]  # fmt: skip


def main(wanted):
    """Solve the cases that are wanted, and write all rows in the order of the cases."""
    rows = {}
    if FILE.exists():
        with FILE.open(newline="", encoding="utf-8") as lines:
            for row in list(csv.reader(lines))[1:]:
                rows.setdefault("-".join(row[:2]) if row[1] else row[0], []).append(row)
    cases = all_cases()
    for case in cases:
        if not wanted or any(part in case.name for part in wanted):
            rows[case.name] = list(rows_of(case))
            print(case.name, rows[case.name][0][-2], flush=True)
            kept = [row for c in cases for row in rows.get(c.name, [])]
            with FILE.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file, lineterminator="\n").writerows([NAMES, *kept])


if __name__ == "__main__":
    main(sys.argv[1:])
