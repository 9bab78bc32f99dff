"""Statistics of a diagnosis: tables, fits, bootstrap, rule. Knows no masonry.

An explanation is here a name, a baseline size and bounds; predictions come as tables of logarithms. What the names mean
and where the numbers come from is the business of the packages above.

In the order in which data pass through: ``noise`` (what is stated of errors, and errors drawn from it), ``grid`` and
``cells`` (a tabulated model), ``likelihood`` and ``fit`` (its best fit to many data sets), ``design`` (all models of a
list in units of the noise, with what is recorded), ``shared_noise`` (noise that tests share), ``confidence_set`` (gate
and causes that are kept), ``discrepancy``, ``evidence_by_kind`` and ``missing`` (what a name is held against),
``judge`` (all of it, to one ``verdict``). ``estimate``, ``gain``, ``verdict_sensitivity`` and ``next_tests`` read a
verdict or a design afterwards.
It gives no posterior probabilities: p values are those of the bootstrap.
"""
