"""Speed against error, growth, cost of features and certificates: ``python -m benchmarks``."""
