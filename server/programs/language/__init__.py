"""Program language: text, statements, points, values."""
