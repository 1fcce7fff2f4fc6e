"""From posed photographs with depth to a coloured mesh that stands upright."""
