"""What people start: the command `openpendant`, the demo, pendants, packet tools and benchmarks."""
