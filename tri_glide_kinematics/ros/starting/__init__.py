"""How nodes and commands start and end."""
