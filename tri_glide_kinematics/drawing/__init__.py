"""What all commands that draw share."""
