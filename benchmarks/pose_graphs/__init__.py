"""How fast and how well pose-graph optimisers do on large graphs."""
