"""Training, prediction and scoring of localizers; ``score`` works without torch."""
