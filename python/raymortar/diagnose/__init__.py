"""Diagnosis of a problem's state: faults of a solution, and messages of a failed solve.

- outcome: what follows a solve, an error or warnings
- findings: all that is doubtful about a converged state
- few_facets, narrow: contact that depends on gamma, or jumps from facet to facet
- lost_contact, tools: surfaces, bodies and rigid tools that have lost each other
- holding, rigid_motions: conditions that hold bodies, and their rigid motions
- inverted: cells that a solve has turned inside out
- missed: masters that a slave meets on no path, or in no solve
- unaccepted: solves under other loads whose steps nobody accepts
- trouble: signs that a solve will not converge
- failure: messages of solves that did not converge, corners of several faces
"""
