"""Training and evaluation of policies; each module with a command line explains itself with ``--help``.

One direction of imports: ``seeds, statistics, budget, policy_file, tasks, traces <- config, policies, learning_curve
<- rollout, run_folder, baselines, bounds, cli <- grid, scores, video, watch, callbacks, clone, mirror, run_command <-
train, ppo, evaluate, figures, tune, rllib <- evolution, compare_gaits, benchmark_cells, benchmark_page, sweep, ppo_ray
<- benchmark, pipeline, inspect_policy <- seed_table``.
"""
