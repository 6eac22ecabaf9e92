"""The findings of the thesis, run anew: its figures and a table of findings.

``python -m snake_env reproduce --help``. From the bottom up: ``serpenoid`` (geometry of a gait), ``placement`` (pegs by
the rule of section 5.5), ``experiment`` and ``experiments`` (what is simulated), ``measures``, ``measures_spatial`` and
``tracking`` (what is measured), ``comparison`` and ``compliant`` (models of others, section 2.3.2), ``mechanism``
(Gray's three links, section 5.3), ``theorem`` and ``lyapunov`` (Theorem 6.1), ``stability`` (limits of sampled
control), ``findings`` (rows and verdicts), ``checks`` (the rows, one module per group of sections), ``report`` and
``command``. Only ``figures`` needs matplotlib.
"""
