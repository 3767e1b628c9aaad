"""Import and export of documents as text."""
