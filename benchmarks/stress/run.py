"""Stress matrix: small scenes over a grid of extremes.

    python benchmarks/stress/run.py [--output DIR] [--limit SECONDS] [--only TEXT] [--jobs N]

Writes matrix.csv and matrix.png, prints what does not converge and why, and fails
if a scene crashes, hangs, reports a wrong answer, or fails without a reason.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import csv
import dataclasses
import json
import selectors
import subprocess
import sys
from pathlib import Path

from cases import PANELS, all_settings, settings
from plot import draw

HERE = Path(__file__).parent
WAYS = (
    "one step",
    "line search",
    "steps",
    "steps with line search",
    "growing steps",
)
# Answers further off than this are not the reference
TOLERANCE = {"column": 1e-5, "punch": 1e-5, "slide": 1e-9}
# With friction the answer depends on the steps
PATH_TOLERANCE = 0.2
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
    sound = (
        answer["imbalance"] <= IMBALANCE
        and answer["penetration"] <= PENETRATION
        and answer["volume"] > 0.0
    )
    if setting.scene == "slide":
        sound = True  # nothing is left to balance
    frictional = setting.friction > 0.0 and setting.scene == "punch"
    allowed = PATH_TOLERANCE if frictional else TOLERANCE[setting.scene]
    # NaN: no reference
    differs = answer["error"] > allowed
    if not sound or (differs and setting.scene != "punch"):
        return "wrong, with a warning" if answer["warned"] else "wrong"
    # An equilibrium, but not that of small steps: large strains have several
    return "another equilibrium" if differs else answer["way"]


def solve_all(limit, wanted, jobs):
    """Answers with verdicts, by setting: each job takes the next one that waits."""
    waiting, answers = iter(wanted), {}

    def work():
        worker = Worker(limit)
        try:
            for setting in waiting:
                answer = worker.ask(setting)
                answer["verdict"] = judge(setting, answer)
                answers[setting] = answer
        finally:
            worker.close()

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for done in [pool.submit(work) for _ in range(jobs)]:
            done.result()
    return {setting: answers[setting] for setting in wanted}


FIGURES = [
    "iterations",
    "floor",
    "condition",
    "error",
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
            error = answer.get("error", float("nan"))
            print(f"{verdict}: {setting}\n    error {error:.1e} {answer['message']}")
    print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    good = (*WAYS, "another equilibrium", "wrong, with a warning", "fails")
    return sum(count for verdict, count in counts.items() if verdict not in good)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("results/stress"))
    parser.add_argument("--limit", type=float, default=60.0, help="seconds per scene")
    parser.add_argument("--jobs", type=int, default=1, help="scenes at a time")
    parser.add_argument("--only", default="", help="panels whose name has this text")
    arguments = parser.parse_args()
    panels = [name for name in PANELS if arguments.only in name]
    shown = {s for name in panels for row in settings(name) for s in row}
    wanted = [s for s in all_settings() if s in shown]
    answers = solve_all(arguments.limit, wanted, arguments.jobs)
    arguments.output.mkdir(parents=True, exist_ok=True)
    write(answers, arguments.output / "matrix.csv")
    draw(panels, answers, arguments.output / "matrix.png")
    return 1 if report(answers) else 0


if __name__ == "__main__":
    sys.exit(main())
