"""Makes what is generated from the declarations: reference page, dissector, vectors, schemas."""
