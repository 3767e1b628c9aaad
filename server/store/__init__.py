"""Documents with revisions, kept in a file that survives a kill, a full disk and a crash."""
