"""What speaks to a running machine as other nodes do."""
