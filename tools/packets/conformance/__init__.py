"""The conformance tester: judges any simple-message server or client, check by check."""
