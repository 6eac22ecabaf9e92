"""Training and evaluation of policies; each module with a command line explains itself with ``--help``.

One direction of imports: ``seeds, statistics, config, budget, policy_file <- policies, run_folder, learning_curve <-
rollout, callbacks, run_command <- grid, scores, figures, video <- train, ppo, evaluate, compare_gaits, throughput <-
pipeline``.
"""
