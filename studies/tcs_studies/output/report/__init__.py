"""Pages about experiments and studies."""
