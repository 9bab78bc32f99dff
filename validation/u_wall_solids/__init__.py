"""The U walls as solids: which reading of the source moves their stiffness and their peak."""
