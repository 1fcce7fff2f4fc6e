"""Hard cases of what the paper compares: losses and pose graphs."""
