"""Hold-to-run jogging: the press, the set-points of each tick, and the desk around them."""
