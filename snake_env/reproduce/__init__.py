"""The findings of the thesis, run anew: figures 7.6 to 7.11, 7.14 and 7.16, and a table of findings.

``python -m snake_env reproduce --help``. From the bottom up: ``serpenoid`` (geometry of a gait),
``placement`` (pegs by the rule of section 5.5), ``experiments`` (what is simulated), ``measures``,
``tracking`` (what section 7.3.5 measures), ``theorem`` (the bound of Theorem 6.1), ``stability`` (limits of sampled
control), ``findings``, ``checks_7_3``, ``checks_7_3_5`` and ``checks_7_5``, ``drawing``, ``figures``,
``figures_7_3_5``, ``report``, ``command``.
"""
