"""Planning worker: the work of a planning process."""
