"""Shapes and pictures of robots for viewers."""
