"""The emulated controller as a pure core."""
