"""Program library: the stored programs, and the requests of pendants for them."""
