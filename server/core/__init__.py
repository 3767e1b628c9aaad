"""The core of a cell and of the server: input, routing, audit trail."""
