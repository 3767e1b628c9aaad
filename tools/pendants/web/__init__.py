"""The browser pendant: its gateway, the page that it serves, and what builds the page."""
