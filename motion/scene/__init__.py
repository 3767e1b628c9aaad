"""Planning scene: objects, shapes, meshes, collision."""
