"""Contacts that are found, cut anew and inherit while blocks move."""
