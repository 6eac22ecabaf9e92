"""The findings of the thesis, run anew: its figures and a table of findings.

``python -m snake_env reproduce --help``. From the bottom up: ``serpenoid`` (geometry of a gait), ``placement`` (pegs by
the rule of section 5.5), ``experiment`` and ``experiments`` (what is simulated), ``measures``, ``measures_spatial`` and
``tracking`` (what is measured), ``theorem`` (the bound of Theorem 6.1), ``stability`` (limits of sampled control),
``findings`` (rows and verdicts), ``checks`` (the rows, one module per group of sections), ``report`` and ``command``.
``drawing`` and ``figures`` need matplotlib, the rest does not.
"""
