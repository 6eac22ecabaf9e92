"""The planar findings of the thesis, run anew: figures 7.6 to 7.9, 7.14 and 7.16, and a table of findings.

``python -m snake_env reproduce --help``. From the bottom up: ``serpenoid`` (geometry of a gait),
``placement`` (pegs by the rule of section 5.5), ``experiments`` (what is simulated), ``measures``,
``findings``, ``checks_7_3`` and ``checks_7_5``, ``drawing``, ``figures``, ``report``, ``command``.
"""
