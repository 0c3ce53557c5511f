"""Wear: contact that loses material where it slips under pressure.

- wear: `Wear`; archard: its usual law
- anderson: the iteration for its implicit steps

Users import it from `fluxes`.
"""
