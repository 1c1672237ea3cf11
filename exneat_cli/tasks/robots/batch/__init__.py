"""Many worlds of one robot in parallel on a GPU, stepped by MuJoCo Warp; imported only when needed."""
