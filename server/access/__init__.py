"""Accounts, roles and login of clients, and the logs of what they did."""
