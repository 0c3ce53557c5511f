"""When an iterate is a solution, and what to say where none is found.

- convergence: the test of forces
- balance, patches: what is judged by itself
- lost_contact, loose, penetration: what a solve must not leave behind
- failure, trouble: what to say of a failure
"""
