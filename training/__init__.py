"""Training and evaluation of policies; each module with a command line explains itself with ``--help``."""
