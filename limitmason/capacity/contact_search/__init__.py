"""Which features of two blocks meet in a pose, what a new contact point inherits, and what overlaps without a point."""
