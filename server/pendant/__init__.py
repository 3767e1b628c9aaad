"""The pendant port: what pendants may ask, and what they are answered and told."""
