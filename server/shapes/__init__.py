"""What robots look like, and the meshes of imported ones."""
