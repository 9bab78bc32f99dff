"""Statistics of a diagnosis: tabulated predictions, fits, bootstrap, the rule, distances. Knows no masonry.

An explanation is here a name, a baseline size and bounds; predictions come as tables of logarithms. What the names mean
and where the numbers come from is the business of the packages above.
"""
