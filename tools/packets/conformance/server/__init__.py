"""The server role: checks that connect to a server and judge what it answers."""
