"""The terminal pendant: a pure core that keys and news go into, and a thin textual shell."""
