"""What the paper compares: other ground truths, and five localizers trained on every data set."""
