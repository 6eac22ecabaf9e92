"""Policies that need torch or Stable-Baselines3; those that do not are in :mod:`snake_env.policies`."""
