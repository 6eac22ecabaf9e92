"""What trains policies."""
