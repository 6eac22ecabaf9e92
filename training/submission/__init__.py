"""Entries of the benchmark: folders that are written, replayed and ranked.

One direction of imports: ``entry, ancestry <- play <- submit, verify``; ``entry <- leaderboard``.
"""
