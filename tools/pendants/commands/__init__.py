"""What an operator types at a terminal: `openpendant stop`, `reset`, `home` and `run`."""
