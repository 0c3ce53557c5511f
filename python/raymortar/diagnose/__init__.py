"""Diagnosis of a problem's state: faults of a solution, and messages of a failed solve.

- outcome: what follows a solve, an error or warnings
- doubts: faults of converged states that are warnings
- lost_contact, unheld, passed_tools, missed_tools: surfaces, bodies and tools that have
  lost each other
- failure: messages of solves that did not converge
"""
