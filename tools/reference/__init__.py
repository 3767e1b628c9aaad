"""Generator of the files made from declarations: reference page, dissector, vectors, schemas."""
