"""Blocks cut into zones that strain, yield and crack in tension, in the plane: level 2 of deformability."""
