"""Evaluation of policies: scores, benchmark, inspection, figures and films."""
