"""Robot description: the robot file with its schema, rules, limits and names."""
