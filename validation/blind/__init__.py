"""Blind tests of the diagnosis: an effect is hidden in data, and must be found, by code that never sees it."""
