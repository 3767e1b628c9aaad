"""Store of documents with revisions, in a file that survives a kill, a full disk and a crash."""
