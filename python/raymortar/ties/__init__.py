"""Surfaces that are tied: `Tie`."""
