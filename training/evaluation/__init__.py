"""How policies are judged: scores, the benchmark, inspection, pictures and films."""
