"""Structures that a push drives, and their curves."""
