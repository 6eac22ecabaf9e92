"""Training and evaluation of policies; each module with a command line explains itself with ``--help``.

One direction of imports: ``seeds, statistics, config <- policies, run_folder <- rollout, callbacks <- grid,
scores, figures, video <- train, evaluate, compare_gaits, throughput <- pipeline``.
"""
