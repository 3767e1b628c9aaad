"""Programs for users: command `openpendant`, demo, pendants, packet tools and benchmarks."""
