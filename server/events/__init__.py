"""Cell events, effects, replies and pending questions."""
