"""Episodes of whole populations at once, in batches of worlds on a GPU; imported only when needed."""
