"""Parameters: their tables, where values come from, and what is made of them."""
