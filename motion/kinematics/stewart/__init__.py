"""Stewart platform: poses, legs, workspace."""
