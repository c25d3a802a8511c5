"""The engine: commands in, setpoints out; it always holds a verified trajectory to rest."""
