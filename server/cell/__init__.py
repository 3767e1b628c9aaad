"""The robot cell: model, motions, interlocks, identification, why."""
