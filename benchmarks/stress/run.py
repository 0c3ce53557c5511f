"""Stress matrix: small scenes over a grid of extremes.

    python benchmarks/stress/run.py [--output DIR] [--limit SECONDS] [--only TEXT]
                                    [--jobs N] [--resume]

Writes matrix.csv and matrix.png, prints what does not converge and why, and fails
if a scene crashes, hangs, reports a wrong answer, or fails without a reason. What is
found is kept line by line in answers.jsonl, from where --resume goes on.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import csv
import dataclasses
import json
import math
import selectors
import subprocess
import sys
from pathlib import Path

from cases import PANELS, all_settings, settings
from plot import draw
from scenes import Setting

HERE = Path(__file__).parent
WAYS = (
    "one step",
    "line search",
    "steps",
    "steps with line search",
    "growing steps",
)
# References of each scene, and how far off them an answer may be
REFERENCES = {
    "column": {"exact": 1e-5},
    "punch": {"steps": 1e-5, "swapped": 0.12},
    "slide": {"free": 1e-9, "work": 0.02},
}
# Under a stiff punch the few facets in 3D are 5 % off in either role, one way and the
# other: 95 and 85 where three times as fine ones have 90 and 88
COARSE = {"swapped": 0.15}
# With friction the answer depends on the steps; gaps that are closed in the mean work
FRICTIONAL = {"steps": 0.01, "work": 0.15}
# What no answer may have: forces out of balance, slave facets of penetration
IMBALANCE, PENETRATION = 1e-6, 0.2


class Worker:
    """The process that solves; started anew when it has died or hangs."""

    def __init__(self, limit):
        self.limit, self.process = limit, None

    def ask(self, setting):
        if self.process is None or self.process.poll() is not None:
            self.process = subprocess.Popen(
                [sys.executable, HERE / "worker.py"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
        line = json.dumps(dataclasses.asdict(setting)) + "\n"
        self.process.stdin.write(line.encode())
        self.process.stdin.flush()
        return self._answer()

    def _answer(self):
        selector = selectors.DefaultSelector()
        selector.register(self.process.stdout, selectors.EVENT_READ)
        while True:
            if not selector.select(self.limit):
                self.close()
                return {"way": "", "message": "", "verdict": "hangs"}
            line = self.process.stdout.readline()
            if not line:
                return {"way": "", "message": "", "verdict": "crashes"}
            if line.startswith(b"answer "):
                return json.loads(line[7:])

    def close(self):
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process = None


def judge(setting, answer):
    """The verdict: the way that converged, or what went wrong."""
    if "verdict" in answer:
        return answer["verdict"]
    if not answer["way"]:
        return "fails" if answer["message"] else "fails without a reason"
    off = compared(setting, answer)
    other = off.get("steps", False)
    wrong = any(off[name] for name in off if name != "steps")
    # A slide has nothing left to balance
    if wrong or not (setting.scene == "slide" or sound(answer)):
        return "wrong, with a warning" if answer["warned"] else "wrong"
    if not off:
        # Nothing else vouches for what comes with a warning
        return "wrong, with a warning" if answer["warned"] else "no reference"
    # An equilibrium, but not that of small steps: large strains have several
    return "another equilibrium" if other else answer["way"]


def sound(answer):
    """Whether it is in balance, without penetration and without folded cells."""
    return (
        answer["imbalance"] <= IMBALANCE
        and answer["penetration"] <= PENETRATION
        and answer["volume"] > 0.0
    )


def compared(setting, answer):
    """Whether the answer is off its references, by the names of those that exist."""
    allowed = dict(REFERENCES[setting.scene])
    if setting.cell in ("tetrahedron", "hexahedron"):
        allowed |= {name: COARSE.get(name, allowed[name]) for name in allowed}
    if setting.friction > 0.0:
        allowed |= {name: FRICTIONAL.get(name, allowed[name]) for name in allowed}
    known = {name: answer[name] for name in allowed if not math.isnan(answer[name])}
    return {name: value > allowed[name] for name, value in known.items()}


def solve_all(limit, wanted, jobs, answers, keep):
    """Answers with verdicts, by setting: each job takes the next one that waits.

    `answers` has those of earlier; `keep` is called with each new one.
    """
    waiting = iter([setting for setting in wanted if setting not in answers])

    def work():
        worker = Worker(limit)
        try:
            for setting in waiting:
                answers[setting] = worker.ask(setting)
                keep(setting, answers[setting])
        finally:
            worker.close()

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for done in [pool.submit(work) for _ in range(jobs)]:
            done.result()
    for setting in wanted:
        answers[setting]["verdict"] = judge(setting, answers[setting])
    return {setting: answers[setting] for setting in wanted}


class Kept:
    """Answers in a file, a line each."""

    def __init__(self, path, resume):
        self.path, self.answers = path, {}
        if resume and path.exists():
            for line in path.read_text().splitlines():
                values, answer = json.loads(line)
                values["divisions"] = tuple(values["divisions"])
                self.answers[Setting(**values)] = answer
        else:
            path.write_text("")

    def add(self, setting, answer):
        with self.path.open("a") as file:
            file.write(json.dumps([dataclasses.asdict(setting), answer]) + "\n")


FIGURES = [
    "iterations",
    "floor",
    "condition",
    "exact",
    "steps",
    "swapped",
    "free",
    "work",
    "imbalance",
    "penetration",
    "volume",
    "seconds",
    "message",
]


def write(answers, path):
    """One line per setting."""
    fields = [f.name for f in dataclasses.fields(next(iter(answers)))]
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow([*fields, "verdict", *FIGURES])
        for setting, answer in answers.items():
            row = [getattr(setting, name) for name in fields]
            figures = [answer.get(name, "") for name in FIGURES]
            short = [f"{x:.3g}" if isinstance(x, float) else x for x in figures]
            table.writerow([*row, answer["verdict"], *short])


def report(answers):
    """Print counts and failures; the number of inexcusable ones."""
    counts = {}
    for setting, answer in answers.items():
        verdict = answer["verdict"]
        counts[verdict] = counts.get(verdict, 0) + 1
        if verdict not in WAYS:
            errors = {n: answer[n] for n in REFERENCES[setting.scene] if n in answer}
            print(f"{verdict}: {setting}\n    {errors} {answer['message']}")
    print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    good = (
        *WAYS,
        "another equilibrium",
        "no reference",
        "wrong, with a warning",
        "fails",
    )
    return sum(count for verdict, count in counts.items() if verdict not in good)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("results/stress"))
    parser.add_argument("--limit", type=float, default=60.0, help="seconds per scene")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at a time")
    parser.add_argument("--only", default="", help="panels whose name has this text")
    parser.add_argument("--resume", action="store_true", help="keep what was found")
    arguments = parser.parse_args(arguments)
    panels = [name for name in PANELS if arguments.only in name]
    shown = {s for name in panels for row in settings(name) for s in row}
    wanted = [s for s in all_settings() if s in shown]
    arguments.output.mkdir(parents=True, exist_ok=True)
    kept = Kept(arguments.output / "answers.jsonl", arguments.resume)
    answers = solve_all(arguments.limit, wanted, arguments.jobs, kept.answers, kept.add)
    write(answers, arguments.output / "matrix.csv")
    draw(panels, answers, arguments.output / "matrix.png")
    return 1 if report(answers) else 0


if __name__ == "__main__":
    sys.exit(main())
