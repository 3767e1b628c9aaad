"""The emulated multi-axis controller, for classes and tests: pure core, asyncio shell."""
