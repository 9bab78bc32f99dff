"""What bounds a multiplier where flow is not known: the bracket of two associative laws, and the proven range."""
