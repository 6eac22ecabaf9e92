"""Test scenes, episodes, scores and their statistics.

One direction of imports: ``seeds, tasks, statistics <- rollout <- scores, film, acting``.
"""
