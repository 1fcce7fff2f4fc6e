"""Which frames of a data set see the same surfaces, and where: from depth and poses."""
