"""Label sets that differ from the true poses."""
