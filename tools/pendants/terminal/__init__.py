"""The terminal pendant: a pure core that takes keys and events, and a thin textual shell."""
