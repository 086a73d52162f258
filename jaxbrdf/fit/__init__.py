"""Training: losses, draws, schedules, the stateless loop and its checkpoints."""
