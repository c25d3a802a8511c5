"""All branches of an F-mechanism."""
