"""Paths of the tool: curves, circles, blending, segments, smoothing."""
