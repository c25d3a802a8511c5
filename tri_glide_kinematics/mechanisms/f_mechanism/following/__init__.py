"""A branch of an F-mechanism, followed through its turning points."""
