"""What the controller was asked for, and what becomes of it."""
