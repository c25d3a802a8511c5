"""Pictures of a calibration, and the command that makes one from a file."""
