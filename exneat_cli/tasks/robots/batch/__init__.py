"""Many worlds of one robot side by side on a GPU, stepped by MuJoCo Warp; imported only when asked for."""
