"""What bounds a multiplier where flow is not known: bracket, and proven range."""
