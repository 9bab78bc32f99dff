"""Sliding with less dilatancy than friction: law, search of the smallest, proof."""
