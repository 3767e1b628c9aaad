"""A gamepad or a SpaceMouse as a pendant: it jogs while its enabling button is held."""
