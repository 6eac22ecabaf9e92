"""Training and evaluation of policies; each module with a command line explains itself with ``--help``.

One direction of imports: ``seeds, statistics, config, budget, policy_file, tasks <- policies, run_folder,
learning_curve, bounds <- rollout, callbacks, run_command, baselines <- grid, scores, figures, video <- train, ppo,
evaluate, compare_gaits, tune, throughput <- benchmark, sweep, pipeline``.
"""
