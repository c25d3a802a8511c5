"""What a node tells: setpoints, states, markers and diagnostics."""
