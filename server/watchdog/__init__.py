"""The watchdog beside the event loop: it stops the robots when the server stands still."""
