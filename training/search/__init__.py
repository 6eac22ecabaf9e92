"""Search over gaits, controllers and seeds."""
