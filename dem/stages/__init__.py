"""Runs through stages of loading: recorded, kept in files, taken up."""
