"""Motion authority and operating mode."""
