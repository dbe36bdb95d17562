"""The five views, what is drawn in them, and how things in them are pointed at."""
