"""Records of events and answers in the journal, and their reading."""
