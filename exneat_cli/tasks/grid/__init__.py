"""Grid worlds: mazes, and predator and prey."""
