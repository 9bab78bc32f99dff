"""What the specimens of the Pavia tilting tests may have looked like: a search that, honestly, says nothing."""
