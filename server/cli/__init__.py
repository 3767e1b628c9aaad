"""Command lines of the server: serving, store, accounts, audit log and programs."""
