"""Sliding with less dilatancy than friction: the law, the search for the smallest multiplier, and its proof."""
