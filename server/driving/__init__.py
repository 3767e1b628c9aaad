"""A motion on its way to the controller: set-points sent ahead, checked, followed, stopped."""
