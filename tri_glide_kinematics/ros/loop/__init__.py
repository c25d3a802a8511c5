"""The loop of a node with a period: its cycle first, all else in what time is left."""
