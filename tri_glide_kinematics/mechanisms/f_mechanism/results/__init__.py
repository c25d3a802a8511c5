"""What solving and following an F-mechanism return."""
