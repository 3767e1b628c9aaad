"""Commands of an operator at a terminal: `openpendant stop`, `reset`, `home` and `run`."""
