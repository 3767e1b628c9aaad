"""Frames: the tree, its file and history, teaching a frame, calibrating a tool."""
