"""Laws that users write as Python functions.

- arguments: what their functions are given, and checks of what they return
- friction: `Friction`, a bound of the tangential traction
"""
